#!/bin/sh
# SPDX-License-Identifier: MIT
# run.sh - every benchmark, with what it ran on. Compare figures of one run only: machines and their neighbours differ.
# Of what takes longest it has fewer questions, smaller sizes, shorter watches, unless LONG is set. What bench.py has run by itself
# is passed over.
set -eu
build=${BUILD:-build}
echo "$(uname -m), $(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2- | sed 's/^ *//'), $(nproc) CPUs, $(cc --version | head -n 1)"
if [ "${LONG:-}" ]; then watch_s=10 asked=4000 cells=1000000; else watch_s=4 asked=1000 cells=100000; fi
for bench in "$build"/tests/bench_*; do
    [ -x "$bench" ] && [ -f "$bench" ] || continue
    case ${bench##*/} in
    *.d | *.o | bench_scaling | bench_octomap_peer) continue ;;
    bench_answers) set -- "$asked" ;;
    bench_components | bench_paper_layout) set -- "$cells" ;;
    *) set -- ;;
    esac
    printf '\n== %s\n' "${bench##*/}"
    "$bench" "$@"
done
printf '\n== cfar_numpy\n'
"$(PATH=/usr/bin:$PATH command -v python3)" tests/bench/cfar_numpy.py
printf '\n== hogs\n'
BUILD=$build tests/bench/hogs.py "$watch_s"
printf '\n== load\n'
BUILD=$build SECONDS=$watch_s tests/live/test_load.py
printf '\n== service\n'
BUILD=$build tests/bench/service.py "$((2 * watch_s))"

# Instructions do not change with the machine's neighbours.
if command -v valgrind >/dev/null; then
    # The aims are for a build with 32-byte vectors all over; the program takes them at run time in its loops only.
    printf '\n== instructions per ping inside the voxel cast\n%-12s %8s %8s %8s\n' scene reached must should
    out=$(mktemp)
    wide=$(mktemp -d)
    cc -O2 -ffp-contract=off -fno-math-errno -fno-trapping-math -march=x86-64-v3 -D_GNU_SOURCE -o "$wide/bench_voxel" \
        tests/bench/bench_voxel.c grid/voxel/*.c grid/geometry.c -lm 2>/dev/null || cp "$build/tests/bench_voxel" "$wide"
    while read -r scene voxel turns pings must should; do
        valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect=submap_cast \
            "$wide/bench_voxel" "$scene" "$voxel" "$turns" 2>"$out" >&2 </dev/null
        awk -v row="$scene $voxel $turns $pings $must $should" '/Collected/ { split(row, r, " ")
            printf "%-12s %8.0f %8s %8s\n", r[1] " " r[2], $4 / r[3] / r[4], r[5], r[6] }' "$out"
    done <<'AIMS'
A 0.5 5 200 1500 800
A 0.2 5 200 2500 1700
A 0.1 5 200 5000 3400
A 0.05 5 200 13000 9000
T 0.1 5 200 - -
B 0.5 1 200 20000 14000
B 0.2 1 200 120000 85000
F 0.2 1 1 - -
AIMS
    rm -r "$wide"
    printf '\n== instructions per bin inside the range extraction\n'
    for detector in ca goca soca os; do
        for bins in 200 1000; do
            valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect=extract_run \
                "$build/tests/bench_extract" "$detector" "$bins" 2>"$out" >&2
            awk -v what="$detector $bins" -v bins="$bins" '/Collected/ { printf "%-9s %9.1f\n", what, $4 / 64 / bins }' "$out"
        done
    done
    printf '\n== instructions per answer, from the line of the request to that of the answer\n'
    for question in blocked sectors nearest limit; do
        valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect='counted*' \
            "$build/tests/bench_answers" counted "$question" 2>"$out" >&2
        awk -v what="$question" '/Collected/ { printf "%-9s %9.0f\n", what, $4 / 20 }' "$out"
    done
    rm -f "$out"
fi
