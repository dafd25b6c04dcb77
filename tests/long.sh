#!/bin/sh
# SPDX-License-Identifier: MIT
# long.sh TARGET... - makes each target, whatever becomes of the others, with its output on the screen and in
# BUILD/long/TARGET.log, and ends with a table: what passed, failed and was skipped, and how long it took. The counts are
# those of the last line "N passed, N failed" of each. Ends with 1 when a target failed.
set -u
build=${BUILD:-build}
logs=$build/long
mkdir -p "$logs" || exit 2
rm -f "$logs"/*.log "$logs/table"
failed=0
for target in "$@"; do
    echo "==== make $target"
    began=$(date +%s)
    { ${MAKE:-make} --no-print-directory BUILD="$build" "$target" 2>&1; echo $? >"$logs/status"; } | tee "$logs/$target.log"
    status=$(cat "$logs/status")
    took=$(($(date +%s) - began))
    counts=$(grep -E '^[0-9]+ passed, [0-9]+ failed' "$logs/$target.log" | awk '
        { sub(/,/, ""); p += $1; f += $3; s += $5 } END { if (NR) printf "%d %d %d", p, f, s; else printf "- - -" }')
    # shellcheck disable=SC2086  # three numbers
    printf '%-14s %8s %8s %8s %5d min %02d s  %s\n' "$target" $counts $((took / 60)) $((took % 60)) \
        "$([ "$status" -eq 0 ] && echo ok || echo FAILED)" >>"$logs/table"
    [ "$status" -eq 0 ] || failed=1
done
echo
printf '%-14s %8s %8s %8s\n' '' passed failed skipped
cat "$logs/table"
exit $failed
