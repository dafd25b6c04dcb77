#!/bin/sh
# SPDX-License-Identifier: MIT
# cleanup.sh - the real recording with the whole image clean-up: the answers are the same bytes with 0, 1 and 2 threads,
# and others than without it.
set -u
build=${BUILD:-build}
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
status=0

verdict() { # name, status of what was tried
    if [ "$2" -eq 0 ]; then echo "ok $1"; else echo "FAIL $1"; status=1; fi
}

for order in safe paper; do
    {
        cat tests/replay/box.conf
        printf '[extract]\norder = %s\nmedian = 5\notsu = on\nclahe = on\nclasses = on\n' $order
    } >"$tmp/$order.conf"
    for threads in 0 1 2; do
        "$build/sonard" --replay tests/replay/box.mcap -c "$tmp/$order.conf" --socket none --threads $threads \
            --answers "$tmp/$order.$threads" 2>"$tmp/log" || cat "$tmp/log"
    done
    test -s "$tmp/$order.0" && cmp "$tmp/$order.0" "$tmp/$order.1" && cmp "$tmp/$order.0" "$tmp/$order.2"
    verdict "cleanup_${order}_is_the_same_with_any_number_of_threads" $?
    ! cmp -s "$tmp/$order.0" tests/replay/box.answers.jsonl
    verdict "cleanup_${order}_changes_something" $?
done
exit $status
