#!/bin/sh
# SPDX-License-Identifier: MIT
# valgrind.sh - a whole replay and the tests that finish in reasonable time under memcheck: no error, no leak.
set -u
build=${BUILD:-build}
status=0
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT

check() { # name, command...
    name=$1
    shift
    if valgrind -q --error-exitcode=99 --leak-check=full --errors-for-leak-kinds=definite,possible \
        "$@" >"$tmp/out" 2>&1; then
        echo "ok valgrind_$name"
    else
        tail -n 30 "$tmp/out"
        echo "FAIL valgrind_$name"
        status=1
    fi
}

command -v valgrind >/dev/null || { echo "skip valgrind: not installed"; exit 0; }
check replay "$build/sonard" --replay tests/replay/box.mcap --socket none --threads 0 --answers "$tmp/a"
check replay_threads "$build/sonard" --replay tests/replay/box.mcap --socket none --threads 2 --answers "$tmp/a"
for t in conf rpc loop pose_log layers ping_frame ping360 record capture_import; do
    check "$t" "$build/tests/test_$t"
done
exit $status
