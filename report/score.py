#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""
score.py - one table of what sonard finds and says, beside its rivals, so that a change shows what it did to everything at
once: drawn waters beam by beam and as a ring of sectors, recordings, and the voxel map beside OctoMap.

  score.py               the split to develop on: seeds 1 to 4 of the drawn waters; prints, and writes report/scores/develop.md
  score.py --release     the split that is run once a version: seeds drawn now; writes report/scores/VERSION.md, which has
                         them, and refuses to run where that file is

Rivals: a fixed threshold, the SOCA-CFAR as bruce_slam has it, the rule of ping360_sonar, and OctoMap where it is installed.
"""
import argparse
import csv
import io
import os
import secrets
import subprocess
import sys

from page import HERE, markdown_table, number, read, write

SEEDS = 4


def rows(build, *command):
    run = subprocess.run([os.path.join(build, "tests", command[0]), *command[1:]], stdout=subprocess.PIPE,
                         stderr=subprocess.DEVNULL, text=True, check=True)
    return list(csv.DictReader(io.StringIO(run.stdout)))


def pivot(data, row, column, *cells):
    columns = list(dict.fromkeys(r[column] for r in data))
    table = {}
    for r in data:
        table.setdefault(r[row], {})[r[column]] = " / ".join(number(r[c]) for c in cells)
    return markdown_table([row, *columns], [[key, *(of.get(c, "") for c in columns)] for key, of in table.items()])


def drawn(build, first):
    seeds = str(first), str(first + SEEDS - 1)
    return (f"### Drawn waters, seeds {seeds[0]} to {seeds[1]}\n\nBeam by beam: all seeds / the worst seed of what is dangerous, "
            "the middle one of what is useful.\n\n" +
            pivot(rows(build, "report_detection", "reach", *seeds), "measure", "method", "all", "seed") +
            "\n\nThe ring of sectors:\n\n" +
            pivot(rows(build, "report_sectors", "csv", *seeds), "measure", "method", "percent"))


def known(build):
    maps = rows(build, "report_water", "maps", "quick")
    return ("### Recordings\n\n" + pivot(rows(build, "report_recordings", "csv"), "what", "method", "result") +
            "\n\n### The map, two short dives\n\n" +
            markdown_table(list(maps[0]), [[number(v) for v in r.values()] for r in maps]))


def main():
    arguments = argparse.ArgumentParser(description="one table of what is found and said, beside rivals")
    arguments.add_argument("--build", default="build", help="folder of the measuring programs")
    arguments.add_argument("--release", action="store_true", help="the split that is run once a version")
    args = arguments.parse_args()
    version = read(os.path.join(HERE, "..", "VERSION")).strip()
    path = os.path.join(HERE, "scores", (version if args.release else "develop") + ".md")
    if args.release and os.path.exists(path):
        sys.exit(f"score.py: report/scores/{version}.md is there: this split is run once a version")
    first = secrets.randbelow(10**9) if args.release else 1
    text = f"# Score of {version}\n\n{drawn(args.build, first)}\n\n{known(args.build)}\n"
    os.makedirs(os.path.dirname(path), exist_ok=True)
    write(path, text)
    print(text)


main()
