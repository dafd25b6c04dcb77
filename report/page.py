# SPDX-License-Identifier: MIT
"""
page - from Markdown and SVG figures to one page of HTML that needs nothing else, and the tables in it. Shared by report.py
and sonard-report. Knows no numbers.
"""
import html
import os
import re
import subprocess

HERE = os.path.dirname(os.path.abspath(__file__))


def read(path):
    with open(path, encoding="utf-8") as f:
        return f.read()


def write(path, text):
    with open(path, "w", encoding="utf-8") as f:
        f.write(text)


def number(text):
    """A short form for tables; text that is no number stays."""
    try:
        value = float(text)
    except ValueError:
        return text
    return f"{value:.0f}" if 1e3 <= abs(value) < 1e7 else f"{value:.3g}"


def number_or_empty(text):
    return re.fullmatch(r"(-?[\d.]+(e[-+]?\d+)?)?", text) is not None


def kib(value):
    return "" if value is None else f"{value / 1024:.1f}"


def markdown_table(header, rows):
    """Columns of numbers are set to the right."""
    right = [rows and all(number_or_empty(row[c]) for row in rows) for c in range(len(header))]
    lines = ["| " + " | ".join(header) + " |", "|" + "".join("---:|" if r else "---|" for r in right)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def plan_table(plan):
    """The plan of sonard --explain=json."""
    rows = [[s["name"], s["of"] or "", "in" if s["in"] else "out", kib(s["bytes"]), s["proof"] or "", s["why"]]
            for s in plan["stages"]]
    rows.append(["**all that is in**", "", "", kib(plan["bytes"]), "", ""])
    return markdown_table(["stage", "of", "plan", "KiB", "proof", "why"], rows)


def gnuplot(script, data, out, quiet=False):
    """Runs HERE/SCRIPT.gp in the common style on the folder `data`, into the folder `out`; quiet: whatever it complains of."""
    subprocess.run(["gnuplot", "-e", f"data='{data}/'; out='{out}/'", os.path.join(HERE, "style.gp"),
                    os.path.join(HERE, script + ".gp")], check=True, stderr=subprocess.DEVNULL if quiet else None)


def figure(folder, match):
    """The figure's SVG itself; its ids get the file's name, since a page holds many."""
    svg = read(os.path.join(folder, match[1] + ".svg"))
    svg = svg[svg.index("<svg"):]
    svg = re.sub(r"(\bid=['\"]|href=['\"]#|url\(#)", rf"\g<1>{match[1]}-", svg)
    return f"<figure>\n{svg}<figcaption>{match[2]}</figcaption>\n</figure>"


def make(folder, text):
    """folder/report.md and folder/index.html, with the figures of the folder inside."""
    contents = []

    def heading(match):
        anchor = re.sub(r"\W+", "-", html.unescape(match[2]).lower()).strip("-")
        contents.append(f'<li class="h{match[1]}"><a href="#{anchor}">{match[2]}</a></li>')
        return f'<h{match[1]} id="{anchor}">{match[2]}</h{match[1]}>'

    write(os.path.join(folder, "report.md"), text)
    body = subprocess.run(["cmark-gfm", "--extension", "table"], input=text, capture_output=True, text=True,
                          check=True).stdout
    body = re.sub(r"<h([23])>(.*?)</h\1>", heading, body)
    body = re.sub(r'<p><img src="(\w+)\.svg" alt="[^"]*" /></p>\n<p><em>(.*?)</em></p>', lambda m: figure(folder, m), body,
                  flags=re.S)
    page = read(os.path.join(HERE, "page.html")).replace("@CONTENTS@", "\n".join(contents))
    write(os.path.join(folder, "index.html"), page.replace("@BODY@", body))
