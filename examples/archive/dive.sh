#!/bin/sh
# SPDX-License-Identifier: MIT
# dive.sh CAPTURE OUT - replays one dive of an archive into OUT/NAME: answers.jsonl, the log, and `took`, which says how it ended.
# What is there already, and newer than the capture, is left alone: a run that was cut off is begun again with the same command.
#
# CONF=file: that configuration for every dive, instead of the one in each capture. THREADS=0, 1 or 2. EVERY=seconds between answers.
set -u
usage() { echo "dive.sh: $1" >&2; echo "usage: dive.sh CAPTURE OUT" >&2; exit 2; }
[ $# -eq 2 ] || usage "expected a capture and a folder"
capture=$1 out=$2
[ -r "$capture" ] || usage "$capture: no such capture, or it cannot be read"
command -v sonard > /dev/null || usage "sonard is not in PATH; in a checkout: make && PATH=\$PWD/build:\$PWD/python:\$PATH"
name=$(printf '%s' "$capture" | sed 's,^[./]*,,; s,\.mcap$,,; s,/,_,g')
done=$out/$name/took
[ -e "$done" ] && [ "$done" -nt "$capture" ] && grep -q '^status 0$' "$done" && exit 0

work=$out/.$name.$(hostname).$$
mkdir -p "$work" || exit 1
trap 'rm -rf "$work"' EXIT
trap 'exit 143' INT TERM
begin=$(date +%s.%N)
sonard --replay "$capture" ${CONF:+-c "$CONF"} --socket none --threads "${THREADS:-0}" \
    --answers "$work/answers.jsonl" --every "${EVERY:-1}" 2> "$work/log"
status=$?
printf 'capture %s\nstatus %d\nseconds %s\nthreads %s\n' "$capture" "$status" \
    "$(echo "$begin $(date +%s.%N)" | awk '{ printf "%.3f", $2 - $1 }')" "${THREADS:-0}" > "$work/took"
rm -rf "${out:?}/$name"
mv "$work" "$out/$name"
exit "$status"
