#!/bin/sh
# SPDX-License-Identifier: MIT
# Checks the models of the ring, of the snapshot, of the records of free water and of jobs for the owner of the grids
# over all interleavings, then that each deliberately broken variant is refuted: a check that cannot fail proves
# nothing. Prints one line per check; ends with 1 when any failed.
# The work files are in BUILD/model; a counterexample is replayed there into NAME.trail.txt.
set -u
cd "$(dirname "$0")/../.." || exit 2
here=$PWD/tests/model
OUT=${BUILD:-build}/model
CC=${CC:-cc}
failed=0

if ! command -v spin >/dev/null; then
    echo "skip model: spin is not installed"
    exit 0
fi

# check MODEL NAME WANT FLAG...: WANT is "holds" or "refuted"
check() {
    model=$here/$1.pml
    name=$1_$2
    want=$3
    shift 3
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
        (cd "$OUT/$name" && spin "$@" -t -p -k "${model##*/}.trail" "$model" >trail.txt 2>&1)
    fi
    states=$(sed -n 's/^ *\([0-9.e+]*\) states, stored.*/\1/p' "$OUT/$name/pan.log" 2>/dev/null)
    if [ "$got" = "$want" ]; then
        echo "ok model_$name ($got, ${states:-?} states)"
    else
        echo "FAIL model_$name: want $want, got $got (see $OUT/$name)"
        failed=1
    fi
}

check ring holds_2_buffers holds -DBUFFERS=2 -DPINGS=6
check ring holds_3_buffers holds -DBUFFERS=3 -DPINGS=6
check ring holds_4_buffers holds -DBUFFERS=4 -DPINGS=7
check ring broken_publish refuted -DBROKEN_PUBLISH
check ring broken_head refuted -DBROKEN_HEAD
check ring broken_wake refuted -DBROKEN_WAKE
check ring broken_stop refuted -DBROKEN_STOP
check snapshot holds holds
check snapshot holds_parts holds -DPARTS
check snapshot broken_side refuted -DBROKEN_SIDE
check snapshot broken_order refuted -DBROKEN_ORDER
check snapshot broken_still refuted -DBROKEN_STILL
check snapshot broken_follow refuted -DPARTS -DBROKEN_FOLLOW
check snapshot broken_had refuted -DBROKEN_HAD
check snapshot odd_number refuted -DODD_NUMBER
check jobs holds holds
check jobs broken_post refuted -DBROKEN_POST
check jobs broken_tell refuted -DBROKEN_TELL
check jobs broken_drop refuted -DBROKEN_DROP
check jobs broken_call refuted -DBROKEN_CALL
check records holds holds
check records broken_take refuted -DBROKEN_TAKE
check records broken_since refuted -DBROKEN_SINCE
check records broken_tell refuted -DBROKEN_TELL
check records broken_close refuted -DBROKEN_CLOSE
check records broken_had refuted -DBROKEN_HAD
check records broken_turn refuted -DBROKEN_TURN
check records broken_place refuted -DBROKEN_PLACE
check records broken_hold refuted -DBROKEN_HOLD
check records broken_keeps refuted -DBROKEN_KEEPS
check records broken_amid refuted -DBROKEN_AMID
check records broken_before refuted -DBROKEN_BEFORE
exit $failed
