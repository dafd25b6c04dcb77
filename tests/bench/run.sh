#!/bin/sh
# SPDX-License-Identifier: MIT
# run.sh - every benchmark, with what it ran on. Compare figures of one run only: machines and their neighbours differ.
set -eu
build=${BUILD:-build}
echo "$(uname -m), $(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2- | sed 's/^ *//'), $(nproc) CPUs, $(cc --version | head -n 1)"
for bench in "$build"/tests/bench_*; do
    [ -x "$bench" ] && [ -f "$bench" ] || continue
    case $bench in *.d | *.o) continue ;; esac
    printf '\n== %s\n' "${bench##*/}"
    "$bench"
done
printf '\n== cfar_numpy\n'
"$(PATH=/usr/bin:$PATH command -v python3)" tests/bench/cfar_numpy.py

# Instructions do not change with the machine's neighbours.
if command -v valgrind >/dev/null; then
    printf '\n== instructions per ping inside the voxel cast\n'
    out=$(mktemp)
    for scene in "A 0.5 5" "A 0.2 5" "A 0.1 5" "A 0.05 5" "T 0.1 5" "B 0.5 1" "B 0.2 1"; do
        # shellcheck disable=SC2086  # three arguments
        valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect=submap_cast \
            "$build/tests/bench_voxel" $scene 2>"$out" >&2
        awk -v scene="$scene" '/Collected/ { split(scene, s, " "); printf "%-9s %9.0f\n", s[1] " " s[2], $4 / 200 / s[3] }' "$out"
    done
    printf '\n== instructions per bin inside the range extraction\n'
    for detector in ca goca soca os; do
        for bins in 200 1000; do
            valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect=extract_run \
                "$build/tests/bench_extract" "$detector" "$bins" 2>"$out" >&2
            awk -v what="$detector $bins" -v bins="$bins" '/Collected/ { printf "%-9s %9.1f\n", what, $4 / 64 / bins }' "$out"
        done
    done
    rm -f "$out"
fi
