#!/bin/sh
# SPDX-License-Identifier: MIT
# Checks the model of the ring over all interleavings, then that each deliberately broken variant is refuted: a
# check that cannot fail proves nothing. Prints one line per check; ends with 1 when any failed.
# OUT=dir keeps the work files (build/model); a counterexample is replayed there into NAME.trail.txt.
set -u
cd "$(dirname "$0")" || exit 2
model=$PWD/ring.pml
OUT=${OUT:-../../build/model}
CC=${CC:-cc}
failed=0

if ! command -v spin >/dev/null; then
    echo "skip model_ring: spin is not installed"
    exit 0
fi

# check NAME WANT FLAG...: WANT is "holds" or "refuted"
check() {
    name=$1
    want=$2
    shift 2
    mkdir -p "$OUT/$name" || exit 2
    (
        cd "$OUT/$name" || exit 2
        rm -f ./*.trail
        spin "$@" -a "$model" >spin.log 2>&1 && "$CC" -w -O2 -DSAFETY -o pan pan.c >cc.log 2>&1 &&
            ./pan -m200000 >pan.log 2>&1
    )
    if [ ! -s "$OUT/$name/pan.log" ] || ! grep -q 'errors:' "$OUT/$name/pan.log"; then
        got="not checked"
    elif grep -q 'max search depth too small' "$OUT/$name/pan.log"; then
        got="not searched to the end"
    elif grep -q 'errors: 0' "$OUT/$name/pan.log"; then
        got=holds
    else
        got=refuted
        (cd "$OUT/$name" && spin "$@" -t -p -k ring.pml.trail "$model" >trail.txt 2>&1)
    fi
    states=$(sed -n 's/^ *\([0-9.e+]*\) states, stored.*/\1/p' "$OUT/$name/pan.log" 2>/dev/null)
    if [ "$got" = "$want" ]; then
        echo "ok model_ring_$name ($got, ${states:-?} states)"
    else
        echo "FAIL model_ring_$name: want $want, got $got (see build/model/$name)"
        failed=1
    fi
}

check holds_2_buffers holds -DBUFFERS=2 -DPINGS=6
check holds_3_buffers holds -DBUFFERS=3 -DPINGS=6
check holds_4_buffers holds -DBUFFERS=4 -DPINGS=7
check broken_publish refuted -DBROKEN_PUBLISH
check broken_head refuted -DBROKEN_HEAD
check broken_wake refuted -DBROKEN_WAKE
check broken_stop refuted -DBROKEN_STOP
exit $failed
