# SPDX-License-Identifier: MIT
"""coverage.py UNITS GATE LIVE - reads what `gcov --json-format --stdout` printed of every object after the unit tests, after
the whole gate, and after the live suites on top. Prints per source file of grid/ and of the parsers which share of its lines
the unit tests ran, the least first, and the lines that they did not; then per folder what the gate and what all tests ran.
Exit status 1: one of the two sums is below 90 %."""
import fnmatch
import json
import os
import sys

AIM = 90.0
PARTS = {
    "grid": ("grid/*",),
    "parsers": ("drivers/*", "config/*", "daemon/rpc/rpc.c", "daemon/options.c", "daemon/map/map_file.c", "daemon/map/map_octomap.c",
                "daemon/background/template_file.c", "client/mavlink/*", "web/web_guard.c", "web/web_metrics.c", "web/web_query.c",
                "client/view/view_rows.c"),
}
# They move bytes between the kernel and a parser and read none themselves; live tests and the virtual machine run them.
NO_PARSERS = ("drivers/ports/port_*", "drivers/ports/can_socket.c", "drivers/gpio/*", "drivers/pose/modbus_depth.c")


def ranges(lines):
    """[1, 2, 3, 7] as "1-3 7"."""
    out = []
    for line in sorted(lines):
        if out and out[-1][1] == line - 1:
            out[-1][1] = line
        else:
            out.append([line, line])
    return " ".join("%d-%d" % tuple(r) if r[0] != r[1] else "%d" % r[0] for r in out)


def read(stream):
    """Of each file {line: was it run?}; a line of a header counts once, whoever included it."""
    files = {}
    for text in stream:
        if not text.startswith("{"):
            continue
        for one in json.loads(text)["files"]:
            lines = files.setdefault(one["file"], {})
            for line in one["lines"]:
                lines[line["line_number"]] = lines.get(line["line_number"], False) or line["count"] > 0
    return files


def part_of(name):
    if any(fnmatch.fnmatch(name, pattern) for pattern in NO_PARSERS):
        return None
    return next((part for part, patterns in PARTS.items() if any(fnmatch.fnmatch(name, p) for p in patterns)), None)


def share(files):
    """(percent of their lines that were run, how many lines)"""
    total = sum(map(len, files.values()))
    return 100.0 * sum(sum(lines.values()) for lines in files.values()) / max(total, 1), total


def by_file(files):
    """Prints the parts file by file; is each part as good as it should be?"""
    good = True
    for part in PARTS:
        mine = {name: lines for name, lines in files.items() if part_of(name) == part and lines}
        for name, lines in sorted(mine.items(), key=lambda item: share({"": item[1]})):
            print("%6.1f %% of %5d  %-36s %s" % (*share({"": lines}), name, ranges(n for n, run in lines.items() if not run)[:160]))
        percent, total = share(mine)
        good = good and percent >= AIM
        print("%6.1f %% of %5d  %s: aim %g %%\n" % (percent, total, part, AIM))
    return good


def by_folder(gate, everything):
    print("%-22s %6s  %6s  %6s  %s" % ("folder", "lines", "gate", "all", "points apart"))
    for folder in sorted({os.path.dirname(name) for name in everything if not os.path.isabs(name)}):
        inside = [{n: lines for n, lines in files.items() if os.path.dirname(n) == folder} for files in (gate, everything)]
        (held, total), (reached, _) = share(inside[0]), share(inside[1])
        print("%-22s %6d  %4.1f %%  %4.1f %%  %5.1f" % (folder, total, held, reached, reached - held))


def main():
    units, gate, everything = (read(open(name, encoding="ascii")) for name in sys.argv[1:4])
    good = by_file(units)
    by_folder(gate, everything)
    return 0 if good else 1


sys.exit(main())
