# SPDX-License-Identifier: MIT
"""What people read, as Markdown and as plain sentences: Markdown itself, manual pages, the comments of sonard.conf and
the messages in C sources."""

import re
import subprocess
import xml.etree.ElementTree as tree

GROFF = {"\\-": "-", "\\e": "\\", "\\(lq": '"', "\\(rq": '"', "\\(aq": "'", "\\(bu": "*", "\\(em": "-", "\\(co": "(c)", "\\&": "",
         "\\(->": "->", "\\(mu": "x", "\\(+-": "+-", "\\(*m": "u", "\\(de": " degrees", "\\ ": " ", "\\(ha": "^", "\\(ti": "~"}


def plain(text):
    """A line of groff without its escapes; what stands in bold, italics or a typewriter's letters as code."""
    text = re.sub(r"\\(\(..|[-e& ])", lambda m: GROFF.get(m[0], ""), text)
    text = re.sub(r"\\f(?:B|I|\(CW|\(CB)(.*?)\\f[RP]", lambda m: "`%s`" % m[1].replace("`", "") if m[1].strip() else m[1], text)
    return re.sub(r"\\f(?:.|\(..)", "", text)


def alternate(name, rest):
    """The words of .BR and the like: every other one is code, but for .B and .I, which are code whole."""
    words = [a or b for a, b in re.findall(r'"([^"]*)"|(\S+)', rest)]
    if len(name) == 1:
        return "`%s`" % " ".join(words)
    return "".join("`%s`" % w if letter != "R" and w.strip() else w for w, letter in zip(words, name * len(words)))


def from_man(source):
    """A manual page as Markdown: headings, paragraphs, tags; examples and tables are left out."""
    out, quiet, tag = [], False, False
    for line in source.splitlines():
        name, _, rest = line.partition(" ")
        if name in (".nf", ".TS"):
            quiet = True
        elif name in (".fi", ".TE"):
            quiet = False
            out.append("")
        elif quiet or line.startswith(("'\\\"", ".\\\"", "@")) or name in (".TH", ".ft"):
            pass
        elif name in (".SH", ".SS"):
            out += ["", "## " + plain(rest.strip('"')), ""]
        elif name == ".TP":
            out.append("")
            tag = True
        elif name in (".PP", ".IP", ".RS", ".RE", ".br"):
            out.append("")
        else:
            text = alternate(name[1:], plain(rest)) if re.fullmatch(r"\.[BIR]{1,2}", name) else plain(line)
            out += [text, ""] if tag else [text]
            tag = False
    # a list of fields in braces is code
    return re.sub(r"\n{3,}", "\n\n", re.sub(r"\{[^{}]*\}", "`x`", "\n".join(out))) + "\n"


def from_configuration(source):
    """The comments of sonard.conf, a paragraph for each key; the words that it allows as code."""
    out = []
    for block in source.split("\n\n"):
        comment = [line[2:] for line in block.splitlines() if line.startswith("# ")]
        allowed = " ".join(line for line in comment if line.startswith("Allowed:"))
        text = "\n".join(line for line in comment if line not in allowed)
        for word in set(re.findall(r"\w+(?=, | or |\.)", allowed[9:])) - {"range"}:
            text = re.sub(r"(?<![\w`])%s(?![\w`])" % word, "`%s`" % word, text)
        out.append(text)
    return "\n\n".join(out) + "\n"


def messages(source):
    """String literals of a C file that are messages, a paragraph each: two words or more; adjacent ones are one."""
    source = re.sub(r"/\*.*?\*/|^\s*#\s*include[^\n]*$", "", source, flags=re.S | re.M)
    out = []
    for run in re.findall(r'"(?:[^"\\\n]|\\.)*"(?:\s*(?:PRI\w+\s*)?"(?:[^"\\\n]|\\.)*")*', source):
        text = "".join(re.findall(r'"((?:[^"\\\n]|\\.)*)"', run)).replace("\\n", " ").replace('\\"', '"')
        if re.search(r"[a-z]{2,} +[a-z]{2,}", text):
            out.append(re.sub(r"[`<>#*_\[\]|]", " ", text).strip())
    return "\n\n".join(out) + "\n"


def blocks(path):
    """The kind and the text of every paragraph, heading and cell of a Markdown file, code left out but for a `x` in its place."""
    xml = subprocess.run(["cmark-gfm", "-e", "table", "-t", "xml", path], check=True, capture_output=True, text=True).stdout
    # the name space of its elements is of no use here
    root = tree.fromstring(re.sub(r'\sxmlns="[^"]*"', "", re.sub(r"<!DOCTYPE[^>]*>", "", xml)))

    def text(node):
        if node.tag == "text":
            return node.text or ""
        if node.tag == "code":
            return "`x`"
        return " " if node.tag in ("softbreak", "linebreak") else "".join(text(child) for child in node)

    return [(node.tag, text(node)) for node in root.iter() if node.tag in ("paragraph", "heading", "table_cell", "table_header_cell")]


def sentences(text):
    """The sentences of a paragraph. In a list of fields, which is code for a quarter, every item counts by itself."""
    fields = 4 * text.count("`x`") > len(words(text))
    end = r"(?<=[.!?])[\"')*]*\s+(?=[\"'(*`]*[A-Z0-9`]|[\w-]+(?: \([^)]*\))?: )" + (r"|[;:]\s+" if fields else "")
    return [s for s in re.split(end, re.sub(r"\b(e\.g|i\.e|vs|cf)\.", r"\1", text)) if words(s)]


def words(sentence):
    return re.findall(r"[^\s]*\w[^\s]*", sentence)
