# SPDX-License-Identifier: MIT
"""coverage.py - reads what `gcov --json-format --stdout` prints of every object, and prints per source file of grid/ and
of the parsers which share of its lines was run, the least first, and the lines that were not. Exit status 1: one of the
two sums is below 90 %."""
import fnmatch
import json
import sys

AIM = 90.0
PARTS = {
    "grid": ("grid/*",),
    "parsers": ("drivers/*", "config/*", "daemon/rpc/rpc.c", "daemon/options.c", "daemon/map/map_file.c", "daemon/map/map_octomap.c",
                "daemon/background/template_file.c", "client/mavlink/*", "web/web_guard.c", "web/web_metrics.c", "web/web_query.c",
                "web/web_rows.c"),
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


def main():
    files = read(sys.stdin)
    good = True
    for part in PARTS:
        mine = {name: lines for name, lines in files.items() if part_of(name) == part and lines}
        total, hit = sum(map(len, mine.values())), sum(sum(lines.values()) for lines in mine.values())
        share = 100.0 * hit / total if total else 0.0
        good = good and share >= AIM
        for name, lines in sorted(mine.items(), key=lambda item: sum(item[1].values()) / len(item[1])):
            print("%6.1f %% of %5d  %-36s %s" % (100.0 * sum(lines.values()) / len(lines), len(lines), name,
                                                 ranges(n for n, run in lines.items() if not run)[:160]))
        print("%6.1f %% of %5d  %s: aim %g %%\n" % (share, total, part, AIM))
    return 0 if good else 1


sys.exit(main())
