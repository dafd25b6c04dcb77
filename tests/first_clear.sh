#!/bin/sh
# SPDX-License-Identifier: MIT
# first_clear.sh - in a clean Debian, as root, beside packages and a ping360_sim: what README's "On a vehicle" says, from
# the installation to the first "clear", then to the page and to Python. Prints what a person types and what comes. Changes
# the system that it runs in: tests/deb.sh runs it in a Debian of its own.
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
typed 'sonarctl blocked 0 --distance 2' || exit 1

# Then what a browser and a Python program get.
printf '$ %s\n' 'apt install ./sonard-web_*.deb ./python3-sonard_*.deb'
# shellcheck disable=SC2211  # one file each
apt-get install -y -q --no-install-recommends ./sonard-web_*.deb ./python3-sonard_*.deb > first_clear.log 2>&1 || { cat first_clear.log; exit 1; }
typed 'sonard-web 2>web.log &'
web=$!
trap 'kill $sim $daemon $web 2>/dev/null' EXIT
typed 'cat > ask.py <<"EOF"
import json, time, urllib.request
import sonard
def page(path):
    for _ in range(100):
        try:
            return urllib.request.urlopen("http://127.0.0.1:9360" + path, timeout=10).read().decode()
        except OSError:
            time.sleep(0.1)
    raise SystemExit("no page")
print("the page:", "canvas" in page("/"), "its scripts:", len(page("/app.js")) > 1000)
print("over HTTP:", json.loads(page("/api/blocked?azimuth_deg=0&distance_m=2"))["state"])
with sonard.connect() as s:
    print("in Python:", s.blocked(0, distance_m=2).state)
EOF
python3 ask.py | tee asked'
[ "$(grep -c -e 'the page: True its scripts: True' -e 'over HTTP: clear' -e 'in Python: clear' asked)" -eq 3 ]
