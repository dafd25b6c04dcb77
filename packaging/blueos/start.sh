#!/bin/sh
# SPDX-License-Identifier: MIT
# start.sh - what runs in the BlueOS extension: sonard, its page and the bridge to the autopilot. Each is started again
# when it ends. What is configured lies in the bind, /data, and is put there the first time.
set -u
data=${SONARD_DATA:-/data}
here=$(cd "$(dirname "$0")" && pwd)
socket=${SONARD_SOCKET:-/run/sonard/sonard.sock}
export SONARD_SOCKET="$socket"
all=

# More than once: a shell loses a signal that comes just as it is born.
end() {
    for _ in 1 2 3; do
        kill "$@" 2> /dev/null
        sleep 0.2
    done
    wait
    exit 0
}
# The newest may not be in all yet.
# shellcheck disable=SC2086  # process ids, in words
trap 'end $all ${!:-}' TERM INT

mkdir -p "$data" "${socket%/*}"
for file in sonard.conf extension.conf; do
    [ -e "$data/$file" ] || cp "$here/$file" "$data/$file"
done
# The last NAME="VALUE" there. The file belongs to the user: root reads it and runs nothing of it.
value() { # NAME
    found=
    while IFS= read -r line; do
        case $line in
        "$1="*) found=${line#*=} ;;
        esac
    done < "$data/extension.conf"
    found=${found#\"}
    echo "${found%\"}"
}
set -f # options are words, not patterns
SONARD_WEB=$(value SONARD_WEB)
SONARD_MAVLINK=$(value SONARD_MAVLINK)

# Only the bind is handed over as root: nothing that reads the network runs so. The image sets the user.
user=${SONARD_USER:-}
[ -z "$user" ] || chown -hR "$user:$user" "$data" "${socket%/*}"
as_user() {
    [ -z "$user" ] || exec su -s /bin/sh "$user" -c 'exec "$0" "$@"' -- "$@"
    exec "$@"
}

# A program, and again two seconds after it has ended, until SIGTERM comes.
keep() {
    trap 'end ${!:-}' TERM
    while :; do
        (as_user "$@") &
        wait $!
        echo "$1 ended with status $?; it is started again" >&2
        sleep 2 &
        wait $!
    done
}

keep sonard -c "$data/sonard.conf" --socket "$socket" &
all=$!
# shellcheck disable=SC2086  # options, in words
keep sonard-web $SONARD_WEB &
all="$all $!"
if [ -n "$SONARD_MAVLINK" ]; then
    # shellcheck disable=SC2086
    keep sonard-mavlink $SONARD_MAVLINK &
    all="$all $!"
fi
wait
