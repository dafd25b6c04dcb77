#!/bin/sh
# SPDX-License-Identifier: MIT
# first_clear.sh - in a clean Debian, as root, beside a package and a ping360_sim: what README's "On a vehicle" says, from
# the installation to the first "clear". Prints what a person types and what comes. Changes the system that it runs in:
# tests/deb.sh runs it in a Debian of its own.
set -u
cd "$(dirname "$0")" || exit 1

typed() { # COMMAND: shown, then done
    printf '$ %s\n' "$1"
    eval "$1"
}

export DEBIAN_FRONTEND=noninteractive
apt-get update -q > first_clear.log 2>&1 || { cat first_clear.log; exit 1; }
printf '$ %s\n' 'apt install ./sonard_*.deb'
# shellcheck disable=SC2211  # one file
apt-get install -y -q --no-install-recommends ./sonard_*.deb > first_clear.log 2>&1 || { cat first_clear.log; exit 1; }
grep '^Setting up sonard' first_clear.log

typed './ping360_sim --scene box --link /tmp/ping360 &'
sim=$!
daemon=
trap 'kill $sim $daemon 2>/dev/null' EXIT
while [ ! -e /tmp/ping360 ]; do sleep 0.1; done
typed 'sonarctl setup --port /tmp/ping360 --mount 0.2,0,0 --size 0.5,0.4,0.3 --range 5 --yes' || exit 1
typed 'sonard --check /etc/sonard/sonard.conf' || exit 1
typed 'sonard 2>sonard.log &'
daemon=$!
while ! sonarctl version > /dev/null 2>&1; do
    kill -0 $daemon || { cat sonard.log; exit 1; }
    sleep 0.1
done
typed 'sonarctl blocked 0 --distance 2'
[ $? -eq 2 ] || exit 1 # nothing was observed: anything but "unknown" is wrong
for _ in $(seq 120); do
    sonarctl blocked 0 --distance 2 > /dev/null && break
    sleep 1
done
typed 'sonarctl blocked 0 --distance 2'
