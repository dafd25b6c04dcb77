#!/bin/sh
# SPDX-License-Identifier: MIT
# box.sh - the real recording through the whole daemon: the demo's promises hold; twice and with 0, 1 and 2 threads the
# answers are the same bytes; and they are the golden ones. GOLDEN=write makes those anew (say why in the commit).
set -u
build=${BUILD:-build}
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
status=0

verdict() { # name, status of what was tried
    if [ "$2" -eq 0 ]; then echo "ok $1"; else echo "FAIL $1"; status=1; fi
}

BUILD=$build tests/demo.sh >"$tmp/demo" 2>&1
result=$?
[ $result -eq 0 ] || cat "$tmp/demo"
verdict demo_finds_the_walls $result
grep -q '^clear' "$tmp/demo" && grep -q '^unknown' "$tmp/demo" && grep -q '^blocked' "$tmp/demo"
verdict demo_shows_all_three_answers $?
# README.md shows some of it, with ... for what it leaves out.
awk '/^    / && /azimuth  state/ { shown = 1 } /^## / { shown = 0 } shown && /^    / && !/\.\.\.$/ { print substr($0, 5) }' README.md >"$tmp/shown"
[ -s "$tmp/shown" ] && ! grep -vxFf "$tmp/demo" "$tmp/shown"
verdict readme_shows_what_the_demo_prints $?
rsvg-convert -o "$tmp/box.png" demo/box.svg 2>"$tmp/svg"
verdict demo_draws_a_valid_svg $?

for run in 0 1 2 0b; do
    "$build/sonard" --replay tests/replay/box.mcap --socket none --threads "${run%b}" --answers "$tmp/$run.jsonl" 2>/dev/null
    verdict "replay_with_threads_$run" $?
done
for run in 1 2 0b; do
    cmp "$tmp/0.jsonl" "$tmp/$run.jsonl"
    verdict "answers_of_run_${run}_are_the_same_bytes" $?
done
[ "${GOLDEN:-}" = write ] && cp "$tmp/0.jsonl" tests/replay/box.answers.jsonl
cmp tests/replay/box.answers.jsonl "$tmp/0.jsonl"
verdict answers_are_the_golden_ones $?
exit $status
