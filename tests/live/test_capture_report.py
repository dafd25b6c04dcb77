#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""sonard-report on a recording: one well-formed page that needs nothing else and says what the daemon says; what is no
capture, and a folder that is there, are refused."""
import csv
import os
import re
import shutil
import xml.etree.ElementTree as xml

from lib import ALL, SONARCTL, SONARD, Skipped, check, run

TOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
CAPTURE = os.path.join(TOP, "tests", "replay", "box.mcap")


def report(bench, capture=CAPTURE, *arguments):
    if not shutil.which("gnuplot") or not shutil.which("cmark-gfm"):
        raise Skipped("gnuplot or cmark-gfm is not installed")
    return bench.run(os.path.join(TOP, "python", "sonard-report"), "--sonard", SONARD, "--sonarctl", SONARCTL, "--every",
                     "0.25", "-o", bench.path("page"), *arguments, capture)


def rows(bench, name):
    with open(bench.path("page/data/%s.csv" % name), newline="", encoding="utf-8") as f:
        return list(csv.DictReader(f))


def page(bench):
    """Every chapter, the figures inside, links to nowhere else; the numbers are those of the recording."""
    done = report(bench)
    check(done.returncode == 0 and not done.stderr, done.stderr)
    root = list(xml.parse(bench.path("page/index.html")).iter())
    tags = [e.tag.rpartition("}")[2] for e in root]
    check(tags.count("figure") == 2 and tags.count("svg") >= 2, "figures: %d" % tags.count("figure"))
    links = [v for e in root for k, v in e.attrib.items() if k.rpartition("}")[2] in ("href", "src")]
    check(all(v.startswith("#") for v in links), "links: %s" % links)
    with open(bench.path("page/report.md"), encoding="utf-8") as f:
        chapters = re.findall("^## (.*)$", f.read(), re.M)
    check(chapters == ["The capture", "The sonars", "What it answered", "What it detected", "How long it takes", "Left out"],
          "chapters: %s" % chapters)
    found = rows(bench, "detections")[0]
    check(found["beams"] == found["with an echo"] == "99", found)
    check([r["stage"] for r in rows(bench, "latency")] == ["extract", "maps"], rows(bench, "latency"))
    check(all(r["pings"] == "101" and float(r["p50_us"]) > 0 for r in rows(bench, "latency")), rows(bench, "latency"))
    answers = rows(bench, "answers")
    check(len(answers) > 15 and int(answers[-1]["blocked"]) > 15, answers[-1])


def left_out(bench):
    """Every stage that can be turned against being left out: what must change nothing does not, what a key bounds is counted, and
    memory is that of the plan. The folder of maps that the configuration names is another sonard's, and no replay goes there."""
    with open(os.path.join(TOP, "tests", "replay", "box.conf"), encoding="ascii") as f:
        box = f.read()
    done = report(bench, CAPTURE, "-c", bench.write("map.conf", box + "[map]\nvoxel = 0.2 m\nmemory = 32 MiB\nload = last\n"
                                                    "save_every = 60 s\ndirectory = %s\n" % bench.path("maps")))
    check(done.returncode == 0 and not done.stderr, done.stderr)
    check(not os.path.exists(bench.path("maps")), "a replay has made the folder")
    proof = {r["stage"]: r for r in rows(bench, "left_out")}
    check(list(proof) == ["cleanup", "marks", "elevation", "map", "image", "threads", "everything on"], list(proof))
    check([s for s, r in proof.items() if r["must_be"] == "same"] == ["map", "image", "threads"], proof)
    check(all(r["changed"] == "0" for r in proof.values() if r["must_be"] == "same"), proof)
    check(all(r["sectors"] == str(72 * len(rows(bench, "answers"))) for r in proof.values()), proof)
    check(int(proof["elevation"]["changed"]) > 0 and proof["elevation"]["plan"] == "in", proof["elevation"])
    check(proof["map"]["plan"] == "in", proof["map"])
    check(int(proof["map"]["with_bytes"]) > int(proof["map"]["without_bytes"]), proof["map"])
    most = max(int(r["with_bytes"]) for r in proof.values())
    check(int(proof["everything on"]["with_bytes"]) == most, proof["everything on"])


def refuses(bench):
    """Nothing is made of what is no capture; what is there stays."""
    done = report(bench, bench.write("no.mcap", "this is none"), "-c", bench.conf())
    check(done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr)
    check(not os.path.exists(bench.path("page")), "left something behind")
    os.mkdir(bench.path("page"))
    done = report(bench, CAPTURE, "-c", bench.conf())
    check(done.returncode == 1 and "there is such a folder" in done.stderr, done.stderr)


def finds_sonard(bench):
    """In the source tree the programs that make has built, and before them installed ones."""
    for folder in ("python", "build", "sbin", "bin"):
        os.makedirs(bench.path("tree/" + folder))
    os.symlink(os.path.join(TOP, "report"), bench.path("tree/report"))
    tool = shutil.copy(os.path.join(TOP, "python", "sonard-report"), bench.path("tree/python"))
    os.symlink(os.path.join(TOP, "python", "sonard_tool.py"), bench.path("tree/python/sonard_tool.py"))
    for folders in (("build", "build"), ("sbin", "bin")):
        for folder, name in zip(folders, ("sonard", "sonarctl")):
            os.chmod(bench.write("tree/%s/%s" % (folder, name), "#!/bin/sh\n"), 0o755)
        said = "".join(bench.run(tool, "--help").stdout.split())
        check(all("tree/%s/%s)" % pair in said for pair in zip(folders, ("sonard", "sonarctl"))), said)


run([("capture_report_" + f.__name__, f) for f in (page, left_out, refuses, finds_sonard)], gate=ALL)
