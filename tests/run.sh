#!/bin/sh
# SPDX-License-Identifier: MIT
# run.sh PROGRAM... - runs test programs and scripts, each from the top of the tree, and adds up their lines:
#   ok NAME / FAIL NAME / skip NAME: why
# JOBS (one per processor) run beside each other. What fails there runs once more, alone: a test against the clock may fail
# because its neighbour held the processor. What a sanitizer reported, and what a signal ended, gets no second try.
# A program that ends with a status other than 0 without a FAIL line counts as one failure, one that says nothing too.
# Prints what failed, what was skipped and what took 5 s or more, and which programs only passed alone. What failed to the
# end is printed again below all of them, and the last line is "N passed, N failed, N skipped".
# LIMIT=seconds for each.
set -u
BUILD=${BUILD:-build} LIMIT=${LIMIT:-600}

# run.sh --one FOLDER PROGRAM: its lines, and its counts as a file in the folder
if [ "${1:-}" = --one ]; then
    folder=$2 program=$3
    out=$folder/$(echo "$program" | tr / _)
    began=$(date +%s)
    timeout -k 10 "$LIMIT" "$program" >"$out" 2>&1 </dev/null
    status=$?
    took=$(($(date +%s) - began))
    p=$(grep -c '^ok ' "$out")
    f=$(grep -c '^FAIL ' "$out")
    s=$(grep -c '^skip ' "$out")
    [ "$status" -ne 0 ] && [ "$f" -eq 0 ] && f=1
    [ "$p" -eq 0 ] && [ "$f" -eq 0 ] && [ "$s" -eq 0 ] && f=1
    echo "$p $f $s" >"$out.counts"
    {
        printf '  %-40s%4d ok' "${program#"$BUILD"/}" "$p"
        [ "$s" -gt 0 ] && printf ', %d skipped' "$s"
        [ "$f" -gt 0 ] && printf ', %d FAILED (status %d)' "$f" "$status"
        [ "$took" -ge 5 ] && printf ', %d s' "$took"
        printf '\n'
        grep '^skip ' "$out" | sed 's/^/      /'
        [ "$f" -gt 0 ] && grep -v '^ok ' "$out" | tail -n 40 | sed 's/^/      /'
    } >"$out.said"
    cat "$out.said" # at once: others print as well
    rm -f "$out.again"
    reported='(ERROR|WARNING): [A-Za-z]*Sanitizer|: runtime error: |a sanitizer complains'
    [ "$f" -gt 0 ] && [ "$status" -lt 124 ] && ! grep -qE "$reported" "$out" && echo "$program" >"$out.again"
    exit 0
fi

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export BUILD LIMIT
printf '%s\0' "$@" | xargs -0 -r -P "${JOBS:-$(nproc)}" -n 1 "$0" --one "$folder"
again=$(cat "$folder"/*.again 2>/dev/null)
for program in $again; do
    echo "once more, alone: ${program#"$BUILD"/}"
    "$0" --one "$folder" "$program"
done
for counts in "$folder"/*.counts; do
    read -r _ failed _ <"$counts"
    [ "$failed" -gt 0 ] && cat "${counts%.counts}.said"
done
cat "$folder"/*.counts | awk -v asked=$# '
    { passed += $1; failed += $2; skipped += $3 }
    END {
        failed += asked - NR # those that could not even be started
        printf "%d passed, %d failed, %d skipped\n", passed, failed, skipped
        exit failed > 0
    }'
