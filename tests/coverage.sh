#!/bin/sh
# SPDX-License-Identifier: MIT
# coverage.sh UNIT... -- GATE... -- LIVE... - runs tests of a build with --coverage in $BUILD and prints which lines they reach:
# the unit tests of grid/ and of what reads bytes from outside, file by file (the aim is 90 % of each of the two sums); then,
# folder by folder, what the gate reaches (unit tests and GATE) beside what the live suites reach on top of it. A folder in
# which the two are more than 5 points apart has something that only a long target holds. The daemons must end by themselves
# to be counted, and write into $BUILD as whoever they run as.
set -eu
build=$BUILD
python=$(PATH=/usr/bin:$PATH command -v python3)
find "$build" -name '*.gcda' -delete

lines() { # lines FILE: the counts so far, as JSON, one object a line
    find "$build" -name '*.gcda' ! -path "$build/tests/*" -print0 | xargs -0 "${GCOV:-gcov}" --json-format --stdout 2>/dev/null >"$1"
}

rm -f "$build"/commands.*
part=units
for word in "$@"; do
    case $part:$word in
    units:--) part=gate ;;
    gate:--) part=live ;;
    *) printf '%s\0' "$word" >>"$build/commands.$part.new" ;;
    esac
done
for part in units gate live; do
    mv "$build/commands.$part.new" "$build/commands.$part"
    LIMIT=1800 xargs -0 tests/run.sh <"$build/commands.$part" >"$build/$part.log" || tail -n 30 "$build/$part.log"
    printf '%-5s  %s\n' "$part" "$(tail -n 1 "$build/$part.log")"
    lines "$build/$part.lines"
done
"$python" tests/coverage.py "$build/units.lines" "$build/gate.lines" "$build/live.lines"
