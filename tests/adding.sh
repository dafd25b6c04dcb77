#!/bin/bash
# SPDX-License-Identifier: MIT
# adding.sh - adds a sonar, a method and a key to a copy of the tree, each in as many files as the table in docs/design.md
# says, builds that, and has sonard play a capture of the sonar, answer the method and print the key. Prints ok/FAIL lines.
set -u
status=0
check() { # NAME COMMAND...
    name=$1
    shift
    if "$@"; then echo "ok $name"; else echo "FAIL $name"; status=1; fi
}
copy=$(mktemp -d)
trap 'kill $sonard 2>/dev/null; rm -rf "$copy"' EXIT
sonard=
rooms='core grid drivers protocol config daemon client'
# shellcheck disable=SC2086  # names without blanks
cp -r Makefile VERSION docs $rooms "$copy"
# touches NAME N: since it was asked last, so many files have changed or come
touches() {
    name=$1 wanted=$2 n=0
    for room in $rooms; do
        n=$((n + $(diff -rq "$room" "$copy/$room" | wc -l)))
    done
    check "$name" test $((n - before)) -eq "$wanted"
    before=$n
}
before=0

# A sonar that sends a byte for each range, in decimetres.
cat > "$copy/drivers/devices/probe_device.c" <<'C'
#include "receiver.h"

static bool probe_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    if (!device_conf_check(&device_probe, conf, fault))
        return false;
    receiver_init(state, conf, "probe", 5000000000u);
    return true;
}

static void probe_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    for (size_t i = 0; i < n; i++) {
        const struct receiver_range range = {.range_m = bytes[i] * 0.1, .resolution_m = 0.1, .aperture_rad = 0.2};
        receiver_heard(state, now_ns, io);
        receiver_ping(state, &range, now_ns, io);
    }
}

static const struct device_key keys[] = {
    {.name = "gain", .lo = 0, .hi = 3, .help = "auto: none"},
    {.name = NULL},
};

const struct device_ops device_probe = {
    .name = "probe",
    .keys = keys,
    .state_size = sizeof(struct receiver),
    .max_beams = 1,
    .max_bins = 1,
    .round = true,
    .init = probe_init,
    .opened = receiver_opened,
    .closed = receiver_closed,
    .feed = probe_feed,
    .tick = receiver_tick,
    .deadline = receiver_deadline,
    .stop = receiver_stop,
    .status = receiver_status,
};
C
sed -i 's/^\( *X(micron)\)/\1 X(probe)/' "$copy/drivers/devices/device.h"
touches adding_a_sonar_touches_2_files 2

awk '/^METHOD\(version,/ {
    print "METHOD(probe, ASKS, \"how many, twice\", PARAMS(INTEGER(\"count\", 1, 9, \"how many\", DEFAULT(4))),"
    print "    RESULT(FIELD(\"twice\", \"integer\", \"as many again\")))"
} { print }' protocol/methods.def > "$copy/protocol/methods.def"
cat >> "$copy/daemon/methods/status_methods.c" <<'C'

bool method_probe(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call, (void)error;
    json_out_open(out, '{');
    json_member_count(out, "twice", 2 * (uint64_t)params_integer(params, "count"));
    json_out_close(out, '}');
    return true;
}
C
touches adding_a_method_touches_2_files 2

sed -i 's/^    int max_clients; .*/&\n    int probe;/' "$copy/config/conf.h"
awk '/^    {"server", "client_timeout",/ {
    print "    {\"server\", \"probe\", INTEGER(1, 9), .standard = \"7\", CONF(server.probe), .help = \"A number.\"},"
} { print }' config/conf_table.c > "$copy/config/conf_table.c"
touches adding_a_key_touches_2_files 2

make --no-print-directory -C "$copy" -j2 CFLAGS=-O0 BUILD=out SAN= out/sonard out/sonarctl out/sonard-protocol.7 out/sonard.conf.5 \
    > "$copy/log" 2>&1 || { tail -n 20 "$copy/log"; echo "FAIL adding_builds"; exit 1; }
new=$copy/out/sonard

# the key: parsed, checked, printed, in the manual page
printf '[sonar a]\ndevice = probe\nport = udp:127.0.0.1:%s\nrange = 30 m\n[server]\nsocket = %s\nprobe = 3\n' \
    $((20000 + $$ % 20000)) "$copy/socket" > "$copy/a.conf"
sed 's/^probe = 3/probe = 12/' "$copy/a.conf" > "$copy/b.conf"
prints() { grep -qE "$1"; }
check adding_the_key_is_printed prints '^probe *= *3' < <("$new" -c "$copy/a.conf" --print)
check adding_the_key_is_checked prints '\[server\] probe = 12' < <("$new" --check "$copy/b.conf" 2>&1)
check adding_the_key_is_in_the_manual grep -q '^\.B probe$' "$copy/out/sonard.conf.5"

# what the sonar's driver says of its keys
for line in 'gain = 3' 'gain = 4' 'step = 2 deg'; do
    printf '[sonar a]\ndevice = probe\nport = udp:127.0.0.1:20001\n%s\n' "$line" > "$copy/${line%% *}.conf"
    "$new" --check "$copy/${line%% *}.conf" >> "$copy/keys" 2>&1
done
check adding_the_sonar_takes_its_key prints 'gain\.conf: no faults' < "$copy/keys"
check adding_the_sonar_has_a_range prints ':4: \[sonar a\] gain = 4: probe takes gain 0 to 3 \(auto: none\)$' < "$copy/keys"
check adding_the_sonar_refuses_other_keys prints 'step = 2 deg: probe does not use this key' < "$copy/keys"
check adding_the_sonar_is_in_the_manual grep -q '^gain 0 to 3 (auto: none)\.$' "$copy/out/sonard.conf.5"

# the method and the sonar, in a running daemon
"$new" -c "$copy/a.conf" 2> "$copy/said" &
sonard=$!
for _ in $(seq 100); do [ -S "$copy/socket" ] && break; sleep 0.1; done
ask() { "$copy/out/sonarctl" --socket "$copy/socket" --json call "$@" 2>&1; }
check adding_the_method_is_answered prints '"twice": *8' < <(ask probe)
check adding_the_method_takes_its_parameter prints '"twice": *4' < <(ask probe '{"count": 2}')
check adding_the_method_refuses prints 'count' < <(ask probe '{"count": 12}')
check adding_the_method_is_in_the_schema prints '"probe"' < <("$new" --schema)
check adding_the_method_is_in_the_manual grep -q probe "$copy/out/sonard-protocol.7"
check adding_the_sonar_is_known prints '"sensors": *\[\{"name": *"a", *"device": *"probe"' < <(ask sensors)
exit $status
