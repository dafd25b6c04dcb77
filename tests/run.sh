#!/bin/sh
# SPDX-License-Identifier: MIT
# run.sh PROGRAM... - runs test programs and scripts, each from the top of the tree, and adds up their lines:
#   ok NAME / FAIL NAME / skip NAME: why
# A program that ends with a status other than 0 without a FAIL line counts as one failure, one that says nothing too.
# Prints what failed, what was skipped and what took 5 s or more, and as its last line "N passed, N failed, N skipped". LIMIT=seconds for each.
set -u
limit=${LIMIT:-600}
passed=0 failed=0 skipped=0
out=$(mktemp)
trap 'rm -f "$out"' EXIT

for program in "$@"; do
    printf '  %-40s' "${program#"${BUILD:-build}"/}"
    began=$(date +%s)
    timeout -k 10 "$limit" "$program" >"$out" 2>&1 </dev/null
    status=$?
    took=$(($(date +%s) - began))
    p=$(grep -c '^ok ' "$out")
    f=$(grep -c '^FAIL ' "$out")
    s=$(grep -c '^skip ' "$out")
    [ "$status" -ne 0 ] && [ "$f" -eq 0 ] && f=1
    [ "$p" -eq 0 ] && [ "$f" -eq 0 ] && [ "$s" -eq 0 ] && f=1
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
    printf '%4d ok' "$p"
    [ "$s" -gt 0 ] && printf ', %d skipped' "$s"
    [ "$f" -gt 0 ] && printf ', %d FAILED (status %d)' "$f" "$status"
    [ "$took" -ge 5 ] && printf ', %d s' "$took"
    printf '\n'
    grep '^skip ' "$out" | sed 's/^/      /'
    [ "$f" -gt 0 ] && grep -v '^ok ' "$out" | tail -n 40 | sed 's/^/      /'
done
printf '%d passed, %d failed, %d skipped\n' "$passed" "$failed" "$skipped"
[ "$failed" -eq 0 ]
