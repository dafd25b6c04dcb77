#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Echo lists end to end: a virtual sweep sonar on a pseudo-terminal, sonard, and what it answers.

The scene is a basin from 6 m behind to 9 m ahead and from 5 m left to 4 m right.
"""
from lib import check, pings_until, run, until
from twin import Twin

TOLERANCE_M = 0.4


def start(bench, *arguments, **keys):
    sim = Twin(bench, "echolist_sim", "--from", "-90", "--to", "90", *arguments)
    conf = {"device": "echolist", "range": "20 m", "step": "3 deg", "mode": "auto"}
    conf.update(keys)
    bench.conf(sonar=conf)
    return sim, bench.sonard().client()


def check_wall(client, azimuth_deg, wall_m):
    sector = client.call("sectors", distance_m=0)["sectors"][azimuth_deg // 5]
    check(sector["state"] == "blocked" and abs(sector["range_m"] - wall_m) <= TOLERANCE_M,
          "%d degrees: %s, the wall is at %g m" % (azimuth_deg, sector, wall_m))


def case_walls(bench):
    _, client = start(bench)
    pings_until(client, 130)
    for azimuth_deg, wall_m in ((0, 9), (90, 4), (270, 5)):
        check_wall(client, azimuth_deg, wall_m)
    sensor = client.sensor()
    check(sensor["state"] == "running" and sensor["what"] == "echo list", str(sensor))
    check(sensor["garbage_bytes"] < 100 and sensor["bad_frame"] == 0, str(sensor))  # the first line may lack its head
    check(client.call("blocked", azimuth_deg=180, distance_m=3)["state"] == "unknown", "it never looked aft")


def case_tilt(bench):
    """A sonar that says it looks 40 degrees up has seen nothing of what is level."""
    _, client = start(bench, "--tilt", "40", aperture="6.5 6.5 deg")
    pings_until(client, 130)
    for azimuth_deg in (0, 45, 90):
        answer = client.call("blocked", azimuth_deg=azimuth_deg, distance_m=2)
        check(answer["state"] == "unknown", "level at %g degrees: %s" % (azimuth_deg, answer))
    up = client.call("blocked", azimuth_deg=0, elevation_deg=40, distance_m=20)
    check(up["state"] == "blocked", "40 degrees up: %s" % up)


def case_wrong_checksums(bench):
    sim, client = start(bench, "--checksum", "yes")
    pings_until(client, 5)
    sim.command("corrupt 5")
    until(lambda: client.sensor()["bad_checksum"] >= 4, "the wrong checksums")
    sim.command("garbage 300")
    pings_until(client, 20)


def case_silence(bench):
    sim, client = start(bench, "--checksum", "no")
    pings_until(client, 5)
    sim.command("silent 8")
    until(lambda: client.sensor()["state"] == "silent", "the silence to be noticed")
    until(lambda: client.sensor()["state"] == "running", "lines to come again")


run([("echolist_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")],
    parallel=3)
