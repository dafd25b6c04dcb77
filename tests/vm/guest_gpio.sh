#!/bin/bash
# SPDX-License-Identifier: MIT
# guest_gpio.sh - power, leak probe and trigger of a running sonard on a simulated GPIO chip.
. tests/vm/guest.sh

sim=/sys/kernel/config/gpio-sim/sonar
mkdir -p $sim/bank0/line{0,1,2,3}/ $sim/bank0/line3/hog
echo sonar-pins > $sim/bank0/label
echo 4 > $sim/bank0/num_lines
for line in 0=sonar-power 1=leak-probe 2=ping-sync 3=taken; do echo "${line#*=}" > "$sim/bank0/line${line%%=*}/name"; done
echo other > $sim/bank0/line3/hog/name
echo output-high > $sim/bank0/line3/hog/direction
live() {
    echo 1 > $sim/live
    pins=/sys/devices/platform/$(cat $sim/dev_name)/$(cat $sim/bank0/chip_name)
}
live

head=$work/head
sleep 1000 | "$BUILD/tests/ping360_sim" --link "$head" --ms-per-gradian 1 > "$work/sim.log" &
write_conf() { # POWER-LINE POWER_CYCLE_AFTER
    cat > "$work/sonard.conf" <<CONF
[sonar front]
device = ping360
port = serial:$head:4000000
range = 5 m
power = $1
power_cycle_after = $2
power_at_stop = off
trigger = ping-sync
[gpio]
chip = sonar-pins
leak = leak-probe
[server]
socket = $work/sock
[record]
directory = $work/captures
CONF
}
begin() {
    "$BUILD/sonard" -c "$work/sonard.conf" 2> "$work/log" &
    sonard=$!
    for _ in $(seq 100); do [ -S "$work/sock" ] && return; sleep 0.1; done
}
finish() {
    kill $sonard
    wait $sonard
}
ask() {
    python3 - "$work/sock" "$1" <<'PY'
import json, socket, sys
s = socket.socket(socket.AF_UNIX)
s.connect(sys.argv[1])
s.sendall(json.dumps({"jsonrpc": "2.0", "id": 1, "method": sys.argv[2], "params": {}}).encode() + b"\n")
print(json.dumps(json.loads(s.makefile().readline())["result"]))
PY
}
field() { # PYTHON-EXPRESSION over s
    ask status | python3 -c "import json, sys; s = json.load(sys.stdin); sys.exit(0 if $1 else 1)"
}
within() { # SECONDS COMMAND...
    local end=$((SECONDS + $1))
    shift
    until "$@"; do [ $SECONDS -lt $end ] || return 1; sleep 0.2; done
}
level() { [ "$(cat "$pins/sim_gpio$1/value")" = "$2" ]; }

write_conf sonar-power never
begin
within 10 level 0 1
judge "power is on"
field 's["leak"]["state"] == "dry"'
judge "the leak probe is dry"
python3 - "$work/sock" "$pins/sim_gpio1/pull" <<'PY'
import json, socket, sys
s = socket.socket(socket.AF_UNIX)
s.connect(sys.argv[1])
s.settimeout(8)
lines = s.makefile()
s.sendall(b'{"jsonrpc":"2.0","id":1,"method":"watch","params":{"method":"status","rate_hz":0.1}}\n')
while True:  # the first notification comes at once, the next would in 10 s
    m = json.loads(lines.readline())
    if "method" in m:
        break
open(sys.argv[2], "w").write("pull-up")
m = json.loads(lines.readline())
sys.exit(0 if m["params"]["result"]["leak"]["state"] == "wet" else 1)
PY
judge "a leak is told to watchers at once"
grep -q 'LEAK' "$work/log"
judge "a leak is logged"
echo pull-down > "$pins/sim_gpio1/pull"
within 5 field 's["leak"]["state"] == "dry" and s["leak"]["alarms"] == 1'
judge "and over again"

within 20 field 's["sensors"][0]["pings"] > 5'
judge "the virtual sonar pings"
for _ in $(seq 40); do
    echo pull-up > "$pins/sim_gpio2/pull"
    sleep 0.05
    echo pull-down > "$pins/sim_gpio2/pull"
done
within 5 field 's["gpio"]["trigger"][0]["edges"] >= 30 and s["gpio"]["trigger"][0]["used"] > 5'
judge "edges of the trigger time the pings"

echo 0 > $sim/live
within 10 field 's["leak"]["state"] == "unknown" and s["gpio"]["power"][0]["state"] == "unknown"'
judge "a chip that is pulled out is noticed"
live
within 10 field 's["leak"]["state"] == "dry" and s["gpio"]["power"][0]["state"] == "on"'
judge "and taken back"
finish
judge "sonard ends"
level 0 0
judge "power is off at the end"
"$BUILD/sonard" --replay "$work"/captures/*.mcap --stay 2> "$work/replay.log" &
sonard=$!
within 20 field 's["mode"] == "replay, ended" and s["gpio"]["trigger"][0]["used"] > 5'
judge "a replay times the pings by the recorded edges"
finish

write_conf taken never
begin
within 5 grep -q "line 'taken' of chip sonar-pins: in use by 'other'" "$work/log"
judge "a line that somebody else has is told with his name"
finish

write_conf sonar-power "5 s"
sed -i "s,^port = .*,port = serial:$work/nobody:115200," "$work/sonard.conf"
begin
within 20 level 0 0
judge "a silent sonar is switched off"
within 20 level 0 1
judge "and on again"
finish
kill %1
echo 0 > $sim/live
