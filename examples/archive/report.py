#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""report.py OUT - one page over all dives that dive.sh has replayed into OUT: OUT/index.html and OUT/dives.csv. The worst come first:
what failed, then by the share of directions that stayed unknown. --pages N makes the page of sonard-report for the N worst, and links it."""
import argparse
import csv
import html
import json
import os
import subprocess
import sys

COLUMNS = ("dive", "ended", "minutes", "x_real_time", "answers", "blocked", "clear", "unknown", "nearest_m", "without_a_pose", "warnings")


def figures(folder):
    """Of one dive, by column; shares are of all sectors of all answers."""
    with open(os.path.join(folder, "took"), encoding="utf-8") as f:
        took = dict(line.rstrip("\n").split(" ", 1) for line in f)
    states, times, nearest, answers, unposed = {"blocked": 0, "clear": 0, "unknown": 0}, [], [], 0, 0
    try:
        with open(os.path.join(folder, "answers.jsonl"), encoding="utf-8") as f:
            for line in f:
                answer = json.loads(line)["sectors"]
                times.append(answer["t_unix"])
                answers, unposed = answers + 1, unposed + (answer["pose_age_s"] is None)
                for sector in answer["sectors"]:
                    states[sector["state"]] += 1
                    if sector["range_m"] is not None:
                        nearest.append(sector["range_m"])
    except FileNotFoundError:
        pass
    with open(os.path.join(folder, "log"), encoding="utf-8", errors="replace") as f:
        log = f.read().splitlines()
    seconds, spent, all_sectors = max(times, default=0) - min(times, default=0), float(took["seconds"]), sum(states.values())
    row = {"dive": os.path.basename(folder), "ended": "well" if took["status"] == "0" else (log or ["status " + took["status"]])[-1],
           "minutes": seconds / 60, "x_real_time": seconds / spent if spent else 0, "answers": answers, "nearest_m": min(nearest, default=None),
           "without_a_pose": unposed / answers if answers else None, "warnings": sum("warning" in line for line in log)}
    row.update({state: n / all_sectors if all_sectors else None for state, n in states.items()})
    return took["capture"], row


def shown(value):
    return "" if value is None else "%.3g" % value if isinstance(value, float) else str(value)


def page(rows, out, linked):
    def cell(row, column):
        name = html.escape(shown(row[column]))
        if column != "dive":
            return "<td>%s</td>" % name
        more = ["<a href='%s/%s'>%s</a>" % (name, file, word) for file, word in (("answers.jsonl", "answers"), ("log", "log"), ("page/index.html", "page"))
                if os.path.exists(os.path.join(out, row["dive"], file))]
        return "<td>%s <small>%s</small></td>" % (name, " ".join(more))
    minutes = sum(row["minutes"] for row in rows)
    failed = sum(row["ended"] != "well" for row in rows)
    head = "".join("<th>%s</th>" % column.replace("_", " ") for column in COLUMNS)
    body = "".join("<tr%s>%s</tr>\n" % (" class='bad'" if row["ended"] != "well" else "", "".join(cell(row, c) for c in COLUMNS)) for row in rows)
    return ("<!doctype html><meta charset='utf-8'><title>sonard: %d dives</title><style>body{font:15px sans-serif;margin:2em}td,th{padding:.2em .8em;"
            "text-align:left;border-bottom:1px solid #ccc}.bad{background:#fdd}</style>\n<h1>%d dives, %.1f hours</h1>\n<p>%d failed. The worst come first%s. "
            "Blocked, clear and unknown are shares of all directions of all answers.</p>\n<table><tr>%s</tr>\n%s</table>\n" %
            (len(rows), len(rows), minutes / 60, failed, ", the first %d with a page of their own" % linked if linked else "", head, body))


def main():
    parser = argparse.ArgumentParser(description="One page over all dives that dive.sh has replayed.")
    parser.add_argument("out", help="the folder that dive.sh has written to")
    parser.add_argument("--pages", type=int, default=0, metavar="N", help="make the page of sonard-report for the N worst (0)")
    options = parser.parse_args()
    if not os.path.isdir(options.out):
        sys.exit("report.py: %s: no such folder; dive.sh makes it: sh dive.sh CAPTURE %s" % (options.out, options.out))
    folders = sorted(e.path for e in os.scandir(options.out) if not e.name.startswith(".") and os.path.exists(os.path.join(e.path, "took")))
    if not folders:
        sys.exit("report.py: %s: no dive in it that dive.sh has replayed" % options.out)
    dives = sorted((figures(folder) for folder in folders), key=lambda d: (d[1]["ended"] == "well", -(d[1]["unknown"] or 0), d[1]["dive"]))
    for capture, row in dives[:options.pages]:
        to = os.path.join(options.out, row["dive"], "page")
        if not os.path.exists(to) and row["ended"] == "well":
            subprocess.run(["sonard-report", "-o", to, capture], check=False)
    rows = [row for _, row in dives]
    with open(os.path.join(options.out, "dives.csv"), "w", newline="", encoding="utf-8") as f:
        writer = csv.DictWriter(f, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows({column: shown(row[column]) for column in COLUMNS} for row in rows)
    with open(os.path.join(options.out, "index.html"), "w", encoding="utf-8") as f:
        f.write(page(rows, options.out, options.pages))
    print("%s/index.html: %d dives, %d failed" % (options.out, len(rows), sum(row["ended"] != "well" for row in rows)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
