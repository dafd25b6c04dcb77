#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Logs of candump as captures, and what sonard says to a CAN port that cannot be. Needs no kernel with CAN; the devices
on a real bus are tested in tests/vm/guest_can.py."""
import json
import os

from lib import ALL, BUILD, SONARD, check, run

CAN_SIM = os.path.join(BUILD, "tests", "can_sim")


def made_log(bench, *arguments):
    made = bench.run(CAN_SIM, "--log", *arguments, "can0")
    check(made.returncode == 0 and made.stdout, made.stderr)
    return bench.write("bus.log", made.stdout)


def conf(bench, *sonars):
    """A configuration of sonars that are (name, {key: value})."""
    return bench.write("can.conf", "".join("[sonar %s]\n%s" % (name, "".join("%s = %s\n" % item for item in keys.items()))
                                           for name, keys in sonars))


def turns(bench, log, configuration, status=0):
    """The turns of every sensor in the replay of log, and what sonard said."""
    replay = bench.run(SONARD, "--replay", log, "-c", configuration, "--socket", "none", "--answers",
                       bench.path("answers"))
    check(replay.returncode == status, replay.stderr)
    with open(bench.path("answers"), encoding="ascii") as f:
        events = [json.loads(line) for line in f]
    counts = {}
    for event in events:
        if event["event"] == "turn":
            counts[event["sensor"]] = counts.get(event["sensor"], 0) + 1
    return counts, events, replay.stderr


def log_of_two_devices(bench):
    log = made_log(bench, "--dronecan", "42", "--rate", "20", "--nmea2000", "35", "--range", "8", "--load", "500",
                   "--seconds", "10")
    counts, events, said = turns(bench, log, conf(
        bench, ("ahead", {"device": "dronecan", "port": "can:can0", "range": "20 m"}),
        ("floor", {"device": "nmea2000", "port": "can:can0", "rotation": "0 -90 0 deg", "range": "20 m"})))
    check(counts == {"ahead": 200, "floor": 10}, str(counts))
    near = min((s["range_m"] for s in events[-1]["sectors"]["sectors"] if s["range_m"] is not None), default=None)
    check(near is not None and abs(near - 8) < 0.3, "the nearest obstacle of the sectors is at %s m" % near)
    check("no configured sonar" not in said, said)


def log_of_can_fd(bench):
    log = made_log(bench, "--dronecan", "42", "--fd", "--seconds", "5")
    counts, _, _ = turns(bench, log, conf(bench, ("ahead", {"device": "dronecan", "port": "can:can0"})))
    check(counts == {"ahead": 50}, str(counts))


def log_of_another_interface(bench):
    log = made_log(bench, "--dronecan", "42", "--seconds", "1")
    counts, _, said = turns(bench, log, conf(bench, ("ahead", {"device": "dronecan", "port": "can:can1"})), status=1)
    check(counts == {} and "30 messages on CAN interfaces that no configured sonar has" in said, said)


def broken_log(bench):
    log = made_log(bench, "--dronecan", "42", "--seconds", "10")
    with open(log, encoding="ascii") as f:
        lines = f.read().splitlines()
    lines[30] = lines[30][:25]
    lines.insert(60, "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)")
    del lines[90]
    counts, _, said = turns(bench, bench.write("bus.log", "\n".join(lines)),
                            conf(bench, ("ahead", {"device": "dronecan", "port": "can:can0"})))
    check(counts == {"ahead": 98}, str(counts))
    check("1 lines were skipped" in said, said)


def log_on_screen(bench):
    """What candump prints without -L is refused, with a sentence that says what would be right."""
    log = bench.write("bus.log", "  can0  123   [2]  11 22\n")
    replay = bench.run(SONARD, "--replay", log, "-c", conf(bench, ("a", {"device": "dronecan", "port": "can:can0"})))
    check(replay.returncode == 1 and "candump -L" in replay.stderr, replay.stderr)


def pairs_that_cannot_be(bench):
    for device, port, wanted in (("dronecan", "serial:/dev/null:115200", "a CAN bus"),
                                 ("ping360", "can:can0", "a stream of bytes")):
        path = conf(bench, ("a", {"device": device, "port": port}))
        ended = bench.run(SONARD, "-c", path, "--socket", "none")
        check(ended.returncode == 3 and wanted in ended.stderr, ended.stderr)


cases = [
    ("candump_log_of_two_devices", log_of_two_devices),
    ("candump_log_of_can_fd", log_of_can_fd),
    ("candump_log_of_another_interface", log_of_another_interface),
    ("candump_log_with_broken_lines", broken_log),
    ("candump_screen_format_is_refused", log_on_screen),
    ("device_and_port_that_do_not_fit", pairs_that_cannot_be),
]

if __name__ == "__main__":
    run(cases, parallel=2, gate=ALL)
