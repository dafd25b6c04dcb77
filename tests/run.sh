#!/bin/sh
# SPDX-License-Identifier: MIT
# run.sh COMMAND... - runs test programs and scripts, each from the top of the tree, and adds up their lines:
#   ok NAME / FAIL NAME / skip NAME: why
# A command is a program with its arguments, in one word. JOBS (one per processor) run beside each other, in the order
# given. A program that ends with a status other than 0 without a FAIL line counts as one failure, one that says nothing too.
# Prints what failed, what was skipped, what failed again below all of it, the five slowest, and last of all
# "N passed, N failed, N skipped".
#
# LIMIT=seconds for each, which only end what hangs. AGAIN=1: what failed runs once more, alone, and both verdicts are
# printed; for tests that measure and need an idle machine. What a sanitizer reported, and what a signal ended, gets no
# second try.
set -u
BUILD=${BUILD:-build} LIMIT=${LIMIT:-600}

# run.sh --one FOLDER COMMAND: its lines, and its counts as a file in the folder
if [ "${1:-}" = --one ]; then
    folder=$2 command=$3
    out=$folder/$(echo "$command" | tr '/ ' '__')
    began=$(date +%s%N)
    # shellcheck disable=SC2086  # a program and its arguments
    timeout -k 10 "$LIMIT" $command >"$out" 2>&1 </dev/null
    status=$?
    took=$((($(date +%s%N) - began) / 1000000))
    p=$(grep -c '^ok ' "$out")
    f=$(grep -c '^FAIL ' "$out")
    s=$(grep -c '^skip ' "$out")
    [ "$status" -ne 0 ] && [ "$f" -eq 0 ] && f=1
    [ "$p" -eq 0 ] && [ "$f" -eq 0 ] && [ "$s" -eq 0 ] && f=1
    echo "$p $f $s" >"$out.counts"
    echo "$took ${command#"$BUILD"/}" >"$out.took"
    {
        printf '  %-40s%4d ok' "${command#"$BUILD"/}" "$p"
        [ "$s" -gt 0 ] && printf ', %d skipped' "$s"
        [ "$f" -gt 0 ] && printf ', %d FAILED (status %d%s)' "$f" "$status" "$([ "$status" -eq 124 ] && echo ": ended after $LIMIT s")"
        [ "$took" -ge 5000 ] && printf ', %d s' $((took / 1000))
        printf '\n'
        grep '^skip ' "$out" | sed 's/^/      /'
        [ "$f" -gt 0 ] && grep -v '^ok ' "$out" | tail -n 40 | sed 's/^/      /'
    } >"$out.said"
    cat "$out.said" # at once: others print as well
    rm -f "$out.again"
    reported='(ERROR|WARNING): [A-Za-z]*Sanitizer|: runtime error: |a sanitizer complains'
    [ "$f" -gt 0 ] && [ "$status" -lt 124 ] && ! grep -qE "$reported" "$out" && echo "$command" >"$out.again"
    exit 0
fi

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# Debian's python3, with the modules that tests/deps.sh installs; and nothing that Python would write beside its sources.
export BUILD LIMIT PATH="/usr/sbin:/usr/bin:/sbin:/bin:$PATH" PYTHONDONTWRITEBYTECODE=1
printf '%s\0' "$@" | xargs -0 -r -P "${JOBS:-$(nproc)}" -n 1 "$0" --one "$folder"
if [ -n "${AGAIN:-}" ]; then
    for file in "$folder"/*.again; do
        [ -e "$file" ] || continue
        command=$(cat "$file")
        echo "once more, alone: ${command#"$BUILD"/}"
        "$0" --one "$folder" "$command"
    done
fi
for counts in "$folder"/*.counts; do
    [ -e "$counts" ] || continue
    read -r _ failed _ <"$counts"
    [ "$failed" -gt 0 ] && cat "${counts%.counts}.said"
done
echo "the slowest:"
cat "$folder"/*.took 2>/dev/null | sort -rn | head -n 5 | awk '{ ms = $1; sub(/^[0-9]+ /, ""); printf "  %7.1f s  %s\n", ms / 1000, $0 }'
cat "$folder"/*.counts 2>/dev/null | awk -v asked=$# '
    { passed += $1; failed += $2; skipped += $3 }
    END {
        failed += asked - NR # those that could not even be started
        printf "%d passed, %d failed, %d skipped\n", passed, failed, skipped
        exit failed > 0
    }'
