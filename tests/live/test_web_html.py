#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The page of sonard-web as written: a screen reader has a name for all that can be used, and the scripts' elements are there.
test_web_page.py tries it in a browser."""
import glob
import html.parser
import re

from lib import ALL, check, run

NAMED = {"button", "select", "input", "canvas", "details", "a"}
VOID = {"meta", "link", "img", "input"}
REFERS = ("aria-controls", "aria-labelledby", "aria-describedby", "for")


class Node:
    def __init__(self, tag, attributes, above):
        self.tag, self.above, self.below, self.text = tag, above, [], ""
        self.has = {name: value or "" for name, value in attributes}

    def all(self):
        yield self
        for node in self.below:
            yield from node.all()

    def words(self):
        return " ".join([self.text] + [node.words() for node in self.below if node.tag not in ("option", "output")]).strip()

    def label(self):
        """What a screen reader calls it; empty: nothing."""
        if self.has.get("aria-label"):
            return self.has["aria-label"]
        if self.tag in ("button", "a"):
            return self.words() or self.has.get("title", "")
        if self.tag == "details":
            return next((node.words() for node in self.below if node.tag == "summary"), "")
        above = self.above
        while above and above.tag != "label":
            above = above.above
        return above.words() if above else ""


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.top = self.at = Node("", [], None)
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        node = Node(tag, attrs, self.at)
        self.at.below.append(node)
        if tag not in VOID:
            self.at = node

    def handle_endtag(self, tag):
        check(self.at.tag == tag, "<%s> is ended by </%s>" % (self.at.tag, tag))
        self.at = self.at.above

    def handle_data(self, data):
        self.at.text += " " + data.strip()


def page():
    with open("web/page/index.html", encoding="utf-8") as f:
        return Page(f.read()).top


def names(_):
    """All that can be used has a name, all that is shown a role that is true of it."""
    nodes = list(page().all())
    filled = {"alarm"}  # by the script, or hidden
    nameless = ["%s#%s" % (n.tag, n.has.get("id", "?")) for n in nodes if n.tag in NAMED and not n.label() and n.has.get("id") not in filled]
    check(not nameless, "without a name: %s" % nameless)
    check(all("alt" in n.has for n in nodes if n.tag == "img"), "an image without alt")
    check(next(n for n in nodes if n.tag == "html").has.get("lang"), "no language")
    check(all(n.has.get("aria-label") for n in nodes if n.tag == "section"), "a region without a name")
    check(all(int(n.has.get("tabindex", 0)) <= 0 for n in nodes), "an order of its own for the Tab key")
    check(all(n.has.get("type") for n in nodes if n.tag == "button"), "a button that may send a form")
    check(all("role" in n.has for n in nodes if n.tag == "canvas"), "a picture without a role")
    check(all(n.has.get("aria-live") == "off" for n in nodes if n.tag == "output"), "an output that is read at every change")
    check(all(any(below.tag == "legend" for below in n.below) for n in nodes if n.tag == "fieldset"), "a group without a name")


def tabs(_):
    """Three tabs, one of them in the order of the Tab key, for a panel that one of them names."""
    nodes = list(page().all())
    tab = [n for n in nodes if n.has.get("role") == "tab"]
    panel, = [n for n in nodes if n.has.get("role") == "tabpanel"]
    check(len(tab) == 3 and all(n.above.has.get("role") == "tablist" and n.above.has.get("aria-label") for n in tab), "no list of tabs")
    check([n.has.get("tabindex") for n in tab].count("-1") == 2 and [n.has["aria-selected"] for n in tab].count("true") == 1, "more than one is chosen")
    check(all(n.has["aria-controls"] == panel.has["id"] for n in tab) and panel.has["aria-labelledby"] in [n.has["id"] for n in tab], "another panel")


def ids(_):
    """What refers to an element, in the page or in its scripts, refers to one that is there, once."""
    nodes = list(page().all())
    known = [n.has["id"] for n in nodes if "id" in n.has]
    check(len(known) == len(set(known)), "twice: %s" % sorted({i for i in known if known.count(i) > 1}))
    wanted = {word for n in nodes for name in REFERS for word in n.has.get(name, "").split()}
    for path in glob.glob("web/page/*.js"):
        with open(path, encoding="utf-8") as f:
            wanted |= set(re.findall(r'(?:\$|getElementById)\("([^"]+)"\)', f.read()))
    check(len(wanted) > 50 and wanted <= set(known), "nowhere: %s" % sorted(wanted - set(known)))


run([("web_html_" + f.__name__, f) for f in (names, tabs, ids)], gate=ALL)
