#!/bin/bash
# SPDX-License-Identifier: MIT
# service_sonard.sh - sonard.service as it is installed, under systemd as process 1: all devices work behind the walls,
# it comes back from whatever ends it, and the other units do what they promise.
. tests/vm/guest.sh

cp -a /run/out/installed/. /
systemd-sysusers && systemd-tmpfiles --create && udevadm control --reload
judge "user, folders, device names"
cat > /etc/udev/rules.d/71-sonar.rules <<'RULE'
SUBSYSTEM=="tty", ENV{ID_VENDOR_ID}=="0403", ENV{ID_MODEL_ID}=="6001", ENV{ID_SERIAL_SHORT}=="A1B2C3", SYMLINK+="sonar-ping360"
RULE
# As brltty's package has it on Ubuntu, for this adapter.
cat > /etc/udev/rules.d/90-brltty-device.rules <<'RULE'
SUBSYSTEM=="usb", KERNEL!="*:*", ENV{PRODUCT}=="403/6001/*", ENV{BRLTTY_BRAILLE_DRIVER}="bm", TAG+="systemd", ENV{SYSTEMD_WANTS}+="brltty-device@.service"
RULE
udevadm control --reload
ip link add vcan0 type vcan && ip link set vcan0 up
chip=/sys/kernel/config/gpio-sim/service
mkdir -p $chip/bank0/line0
echo 2 > $chip/bank0/num_lines
echo LEAK > $chip/bank0/line0/name
echo 1 > $chip/live
udevadm settle
cat > /etc/sonard/sonard.conf <<'CONF'
[sonar head]
device = ping360
port = serial:/dev/sonar-ping360:115200
range = 10 m
[sonar altimeter]
device = dronecan
port = can:vcan0
[sonar network]
device = ping1d
port = udp:127.0.0.1:9090
[gpio]
leak = LEAK
[record]
directory = /var/lib/sonard/captures
[realtime]
priority = 40
lock_memory = on
[map]
voxel = 0.2 m
directory = /var/lib/sonard/maps
[pose]
max_age = 30 min
CONF
mkdir -p /etc/systemd/system/sonard.service.d
printf '[Service]\nWatchdogSec=3s\nTimeoutAbortSec=1s\n' > /etc/systemd/system/sonard.service.d/quick.conf # a test cannot wait
systemctl daemon-reload

log() { journalctl -u sonard -o cat --no-pager; }
ask() { setpriv --reuid=nobody --regid="${group:-sonard}" --clear-groups sonarctl "$@"; }
pid() { systemctl show -P MainPID sonard; }
restarts() { systemctl show -P NRestarts sonard; }
soon() { # COMMAND...: true within half a minute?
    for _ in $(seq 150); do "$@" > /dev/null 2>&1 && return 0; sleep 0.2; done
    return 1
}
logged() { log | grep -q -- "$1"; }
pings() { ask status --json | sed -n 's/.*"name":"head"[^}]*"pings":\([0-9]*\).*/\1/p'; }
pings_again() { local n; n=$(pings) && sleep 1 && [ "$(pings)" -gt "$n" ]; }
answers() { ask version; }

systemctl start sonard
judge "systemctl start returns when questions are answered"
answers > /dev/null
judge "a member of the group sonard may ask at once"
group=nogroup answers > /dev/null 2>&1
[ $? -ne 0 ]
judge "nobody else may"
grep -q 'CapEff:.*0000000000000000' "/proc/$(pid)/status" && [ "$(ps -o user= -p "$(pid)")" = sonard ]
judge "its own user, no capabilities"
[ "$(ps -o cls= -p "$(pid)" | tr -d ' ')" = FF ] && [ "$(ps -o rtprio= -p "$(pid)" | tr -d ' ')" = 40 ]
judge "SCHED_FIFO 40, as configured"
[ "$(awk '/VmLck/ {print $2}' "/proc/$(pid)/status")" -gt 1000 ]
judge "memory locked, as configured"
soon logged "line 'LEAK' acquired"
judge "a GPIO line"
soon logged "altimeter: can:vcan0 open"
judge "a CAN bus"
logged "network access is not permitted"
judge "a sonar on the network is not permitted, and the log says what opens it"

journalctl -u sonard -o json --no-pager SONARD_EVENT=port_open SONARD_SONAR=altimeter |
    grep '"PRIORITY":"5"' | grep '"SYSLOG_IDENTIFIER":"sonard"' | grep '"CODE_FILE":"daemon/input/[a-z_]*[.]c"' | grep -q '"CODE_FUNC":'
judge "its entries in the journal have fields"

touch /run/out/plug
soon test -e /dev/sonar-ping360
judge "an adapter plugged in after the start has its name"
device=$(realpath "/sys$(udevadm info -q path /dev/sonar-ping360)/../../../..")
udevadm info -q property /dev/sonar-ping360 | grep -qx ID_MM_DEVICE_IGNORE=1 && udevadm info -q property "$device" | grep -qx ID_MM_DEVICE_IGNORE=1
judge "ModemManager is to leave it alone"
udevadm info -q property "$device" | grep -q ID_VENDOR_ID && ! udevadm info -q property "$device" | grep -E '^(BRLTTY|SYSTEMD_WANTS)'
judge "brltty is not started for it"
soon pings_again
judge "the Ping360 behind it pings"
rm /run/out/plug
soon test ! -e /dev/sonar-ping360 && ask version > /dev/null
judge "pulled out, the service lives"
touch /run/out/plug
soon pings_again
judge "plugged in again, it pings again"

map_pings() { ask map status --json | sed -n 's/.*"pings":\([0-9]*\).*/\1/p'; }
map_has() { [ "$(map_pings)" -ge "$1" ]; }
ask pose --attitude 0,0,0 --position 0,0,2 > /dev/null && soon map_has 3
judge "the map takes pings"
before=$(pid) entered=$(map_pings)
sed -i 's/^max_age = 30 min/max_age = 50 min/; s/^voxel = 0.2 m/voxel = 0.3 m/' /etc/sonard/sonard.conf
systemctl reload sonard
soon logged "1 changed, 1 need a restart"
judge "systemctl reload takes the live key, and names the one that is not"
[ "$(pid)" = "$before" ] && map_has "$entered" && ask map status --json | grep -q '"voxel_m":0.2'
judge "without another process or another map"
sed -i 's/^max_age = .*/max_age = 50 parsecs/' /etc/sonard/sonard.conf
systemctl reload sonard
journalctl -u sonard -o cat SONARD_EVENT=reload_fault | grep -q parsecs && answers && map_has "$entered"
judge "a configuration with a fault changes nothing, and the journal says which"
sed -i 's/^max_age = .*/max_age = 30 min/; s/^voxel = .*/voxel = 0.2 m/' /etc/sonard/sonard.conf

before=$(pid)
kill -SEGV "$before"
soon answers && [ "$(restarts)" = 1 ] && [ "$(pid)" != "$before" ]
judge "after a crash it is there again"
kill -STOP "$(pid)"
soon test "$(restarts)" = 1
for _ in $(seq 100); do [ "$(restarts)" = 2 ] && break; sleep 0.2; done
[ "$(restarts)" = 2 ] && soon answers
judge "a daemon that hangs is ended by the watchdog and started again"
soon pings_again
judge "and the sonar pings again"

cp /usr/share/sonard/network.conf /etc/systemd/system/sonard.service.d/
systemctl daemon-reload && systemctl restart sonard && soon logged "network: udp:127.0.0.1:9090 open"
judge "network.conf opens the network"
begun=$(date +%s%N)
systemctl stop sonard
[ "$(systemctl show -P Result sonard)" = success ]
judge "a clean stop"
echo "# stopped in $((($(date +%s%N) - begun) / 1000000)) ms"
[ -d /run/sonard ] && ls /var/lib/sonard/captures/*.mcap > /dev/null
judge "captures stay"

systemctl start sonard.socket && [ "$(systemctl is-active sonard)" != active ] && soon answers &&
    [ "$(systemctl is-active sonard)" = active ]
judge "sonard.socket starts it when somebody asks"
systemctl stop sonard.socket sonard

install -o sonard -g sonard tests/replay/box.mcap /var/lib/sonard/captures/box.mcap
systemctl start sonard-replay@box && soon ask --socket /run/sonard-replay-box/sonard.sock version
systemctl is-active sonard-replay@box > /dev/null
judge "sonard-replay@ plays a capture and answers"
systemctl stop sonard-replay@box
systemctl start sonard-mavlink && sleep 1 && systemctl is-active sonard-mavlink > /dev/null
judge "sonard-mavlink waits for its autopilot"
systemctl stop sonard-mavlink
