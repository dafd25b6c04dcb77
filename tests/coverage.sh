#!/bin/sh
# SPDX-License-Identifier: MIT
# coverage.sh PROGRAM... - runs unit tests built with --coverage below $BUILD and prints which share of the lines they
# reach: for every file of grid/ and of what reads bytes from outside, and for all of both. The aim is 90 % of each.
set -eu
build=$BUILD
find "$build" -name '*.gcda' -delete
LIMIT=900 tests/run.sh "$@" >"$build/tests.log" || tail -n 30 "$build/tests.log"
tail -n 1 "$build/tests.log"
python=$(PATH=/usr/bin:$PATH command -v python3)
find "$build/core" "$build/grid" "$build/drivers" "$build/config" "$build/daemon" "$build/client" "$build/web" -name '*.gcda' |
    xargs "${GCOV:-gcov}" --json-format --stdout 2>/dev/null | "$python" tests/coverage.py
