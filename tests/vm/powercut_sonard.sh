#!/bin/bash
# SPDX-License-Identifier: MIT
# powercut_sonard.sh - one life between two power cuts: has what was confirmed before the last one come back, whole? Then
# the map and the background are saved as often as they can be until the power fails, or, with END=yes, that is all.
# /dev/vda is the vehicle's disk. What is confirmed is told to the host in /run/out/confirmed.*: when it was
# written, and its checksum.
. tests/vm/guest.sh

cp -a /run/out/installed/. /
systemd-sysusers && systemd-tmpfiles --create
mkdir -p /var/lib/sonard && mount /dev/vda /var/lib/sonard && mkdir -p /var/lib/sonard/maps
judge "the disk is mounted again"
map=/var/lib/sonard/maps/last.map background=/var/lib/sonard/head.bg
chown -R sonard:sonard /var/lib/sonard
cat > /etc/udev/rules.d/71-sonar.rules <<'RULE'
SUBSYSTEM=="tty", ENV{ID_VENDOR_ID}=="0403", ENV{ID_MODEL_ID}=="6001", ENV{ID_SERIAL_SHORT}=="A1B2C3", SYMLINK+="sonar-ping360"
RULE
udevadm control --reload && udevadm trigger && udevadm settle
cat > /etc/sonard/sonard.conf <<CONF
[sonar head]
device = ping360
port = serial:/dev/sonar-ping360:115200
range = 5 m
step = 18 deg
background = $background
[background]
save_every = 1 s
[map]
voxel = 0.2 m
directory = /var/lib/sonard/maps
save_every = 1 s
load = last
[pose]
max_age = 1 h
CONF

written() { # FILE: seconds and checksum of what it holds now
    [ -e "$1" ] && exec 3< "$1" || return 1
    echo "$(stat -L -c %.9Y /proc/self/fd/3) $(sha256sum <&3 | cut -d' ' -f1)"
}
newest() { # FILE: what was confirmed, or what came after
    local old old_sum now now_sum
    read -r old old_sum < "/run/out/confirmed.${1##*.}"
    read -r now now_sum < <(written "$1")
    [ "$now $now_sum" = "$old $old_sum" ] || awk "BEGIN {exit !(${now:-0} > $old)}"
}
log() { journalctl -u sonard -o cat --no-pager; }
ask() { setpriv --reuid=nobody --regid=sonard --clear-groups sonarctl "$@"; }
told() { ask map status --json | grep -q '"kept":{"what":"save","state":"done"'; }
saved() { ask background show --json | grep -q '"saved":true'; }
learn() { # another template, when the one before is safe
    local state
    state=$(ask background show --json)
    grep -q '"learning":null' <<< "$state" && grep -q '"template":null\|"saved":true' <<< "$state" &&
        ask background learn --pings 2 --standing --no-wait > /dev/null
}
confirm() { # FILE, COMMAND that tells that no save is under way: what is there now is there after a power cut
    local said
    said=$(written "$1") || return 1
    "$2" || return 1
    echo "$said" > "/run/out/confirmed.new" && mv /run/out/confirmed.new "/run/out/confirmed.${1##*.}"
}

for file in "$map" "$background"; do
    [ -e "/run/out/confirmed.${file##*.}" ] || continue
    newest "$file"
    judge "${file##*/}: what was confirmed, or newer"
    had=yes
done
systemctl start sonard
judge "sonard starts"
if [ -e /run/out/confirmed.map ]; then
    log | grep -q "map: loaded from $map"
    judge "the map is whole"
fi
if [ -e /run/out/confirmed.bg ]; then
    log | grep -q "background: loaded from $background"
    judge "the background is whole"
fi
! ls /var/lib/sonard/*.damaged /var/lib/sonard/maps/*.damaged > /dev/null 2>&1
judge "nothing is torn"
if [ "${END:-}" = yes ]; then
    [ "${had:-}" = yes ]
    judge "something had been saved"
    exit
fi

north=0
while :; do
    north=$((north + 1))
    ask pose --attitude 0,0,0 --position "$((north % 20)),0,2" > /dev/null
    learn
    confirm "$map" told
    confirm "$background" saved && [ -e /run/out/confirmed.map ] && touch /run/out/saving
    sleep 0.2
done
