#!/bin/sh
# SPDX-License-Identifier: MIT
# demo.sh - replays the recording in tests/replay and shows what a pilot would be told: the sectors, the walls found
# against the walls known, and a picture in demo/box.svg. BUILD names the build folder.
set -eu
build=${BUILD:-build}
out=demo
mkdir -p "$out"
socket=$(mktemp -u "${TMPDIR:-/tmp}/sonard-demo-XXXXXX")

"$build/sonard" --replay tests/replay/box.mcap --stay --socket "$socket" 2>"$out/sonard.log" &
daemon=$!
trap 'kill "$daemon" 2>/dev/null; wait "$daemon" 2>/dev/null || true' EXIT

ask() {
    "$build/sonarctl" --socket "$socket" "$@"
}

tries=0
until ask --json status 2>/dev/null | grep -q '"mode":"replay, ended"'; do
    tries=$((tries + 1))
    [ "$tries" -lt 200 ] || { echo "sonard did not finish the replay:" >&2; cat "$out/sonard.log" >&2; exit 1; }
    kill -0 "$daemon" 2>/dev/null || { cat "$out/sonard.log" >&2; exit 1; }
    sleep 0.05
done

echo "A Ping360 in a channel 0.555 m wide, 101 pings of 2 m (tests/replay/README.md): sectors that were looked at"
echo
ask sectors | awk 'NR <= 2 || !/ -$/'
echo
echo "First echoes against the channel's walls, which are known to about a centimetre"
echo
status=0
ask --json call image '{}' | "$build/tests/walls" || status=$?
echo
for question in "5 --distance 1 --half-angle 2" "0 --distance 2" "180 --distance 2"; do
    echo "\$ sonarctl blocked $question"
    # shellcheck disable=SC2086  # several words
    ask blocked $question || true
done
echo
ask plot -o "$out/box.svg"
echo "Picture: $out/box.svg"
exit $status
