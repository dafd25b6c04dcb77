#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""What a reader copies from the pages works: configurations pass --check, and the manual pages have the options that the
programs have."""
import glob
import os
import re
import textwrap

from lib import ALL, BUILD, SONARCTL, SONARD, check, note, run

PAGES = ["README.md"] + sorted(glob.glob("docs/*.md") + glob.glob("docs/devices/*.md"))
SECTION = re.compile(r"^\[(\w+)[^\]]*\]", re.M)
LEAST = {"device": "ping360", "port": "serial:/dev/ttyUSB0:115200"}


def blocks(text):
    """The indented blocks of a page, blank lines within them included."""
    for block in re.findall(r"(?:^    .*\n|^\n(?=    ))+", text, re.M):
        yield textwrap.dedent(block).strip("\n") + "\n"


def completed(text):
    """The block from its first section on, with the sonar that a part of a configuration leaves to the reader."""
    text = text[SECTION.search(text).start():]
    if "[sonar" not in text:
        text += "[sonar front]\n"
    head, sonar, keys = re.split(r"^(\[sonar [^\n]*\n)", text, maxsplit=1, flags=re.M)
    own = SECTION.split(keys)[0]
    missing = "".join("%s = %s\n" % item for item in LEAST.items() if not re.search("^%s *=" % item[0], own, re.M))
    return head + sonar + missing + keys


def complaints(bench, conf):
    """What --check says of it, but for keys that want others which the reader gives, and for what no key changes."""
    out = bench.run(SONARD, "--check", conf)
    said = [line for line in (out.stdout + out.stderr).splitlines()
            if not line.endswith("has no effect without voxel") and "sends ranges without samples" not in line]
    return [] if out.returncode == 0 and said == ["%s: no faults" % conf] else said


def configurations(bench):
    """Of every page, and the scenes to copy."""
    wrong, n = [], 0
    for page in PAGES:
        with open(page, encoding="utf-8") as f:
            found = [b for b in blocks(f.read()) if SECTION.search(b) and re.search(r"^\w+ = ", b, re.M)]
        for block in found:
            n += 1
            wrong += ["%s: %s" % (page, said) for said in complaints(bench, bench.write("page.conf", completed(block)))]
    for scene in sorted(glob.glob("config/scenes/*.conf")) + ["packaging/blueos/sonard.conf"]:
        n += 1
        wrong += complaints(bench, scene)
    note("%d configurations" % n)
    check(not wrong and n > 20, "%d: %s" % (n, "".join(wrong)))


def told_by(bench, program):
    """The options that --help tells, those of commands included."""
    out = bench.run(program, "--help").stdout
    if program == SONARCTL:
        out += "".join(bench.run(program, c, "--help").stdout for c in re.findall(r"^  ([a-z_]+) ", out, re.M) if c != "capture")
    return set(re.findall(r"^ +(?:-\w(?: [A-Z]+)?, )?(--[a-z0-9-]+)", out, re.M))


def options(bench):
    """Every option of --help stands in the manual page, and the page explains no other."""
    for program, page in ((SONARD, "sonard.8"), (SONARCTL, "sonarctl.1"), (os.path.join(BUILD, "sonard-mavlink"), "sonard-mavlink.8"),
                          (os.path.join(BUILD, "sonard-web"), "sonard-web.8"),
                          ("python/sonard-tune", "sonard-tune.1"), ("python/sonard-report", "sonard-report.1")):
        told = told_by(bench, program)
        with open("docs/" + page, encoding="utf-8") as f:
            text = re.sub(r"\\f.", "", f.read()).replace("\\-", "-")
        mentioned = set(re.findall(r"--[a-z0-9-]*[a-z0-9]", text))
        explained = set(re.findall(r"--[a-z0-9-]*[a-z0-9]", "\n".join(re.findall(r"^\.TP\n(.*)", text, re.M))))
        missing = told - mentioned - {"--help"}
        check(len(told) > 5 and not missing, "%s: not in the page: %s" % (page, sorted(missing)))
        check(explained and explained <= told | {"--help", "--version"}, "%s: not in --help: %s" % (page, sorted(explained - told)))


run([("docs_configurations", configurations), ("docs_options", options)], gate=ALL)
