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
