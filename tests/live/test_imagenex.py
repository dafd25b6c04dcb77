#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Imagenex 852 and 881A end to end: a virtual head on a pseudo-terminal, sonard, and what it answers.

The scene is a basin from 6 m behind to 9 m ahead and from 5 m left to 4 m right.
"""
from lib import check, pings_until, run, until
from twin import Twin

TOLERANCE_M = 0.3


def start(bench, model, **keys):
    sim = Twin(bench, "imagenex_sim", "--model", model)
    conf = {"device": "imagenex" + model, "range": "10 m"}
    if model == "881a":
        conf["step"] = "2.4 deg"
    conf.update(keys)
    bench.conf(sonar=conf)
    return sim, bench.sonard().client()


def check_wall(client, azimuth_deg, wall_m):
    sector = client.call("sectors", distance_m=0)["sectors"][azimuth_deg // 5]
    check(sector["state"] == "blocked" and abs(sector["range_m"] - wall_m) <= TOLERANCE_M,
          "%d degrees: %s, the wall is at %g m" % (azimuth_deg, sector, wall_m))


def case_full_circle(bench):
    """The whole chain over a serial line; tests/voyage/test_heads.py has the other ways to look at it."""
    _, client = start(bench, "881a")
    pings_until(client, 170)
    for azimuth_deg, wall_m in ((0, 9), (90, 4), (180, 6), (270, 5)):
        check_wall(client, azimuth_deg, wall_m)


def case_damage_costs_only_itself(bench):
    sim, client = start(bench, "852")
    pings_until(client, 5)
    for command in ("garbage 500", "drop 1", "short 1", "split 1"):
        sim.command(command)
        pings_until(client, 5)
    sensor = client.sensor()
    check(sensor["garbage_bytes"] > 500 and sensor["timeouts"] >= 2, str(sensor))
    check_wall(client, 0, 9)


def case_silence(bench):
    sim, client = start(bench, "852")
    pings_until(client, 5)
    sim.command("silent 3")
    until(lambda: client.sensor()["state"] == "silent", "the silence to be noticed")
    until(lambda: client.sensor()["state"] == "running", "the head to be asked again")


def case_unplugged(bench):
    sim, client = start(bench, "852")
    pings_until(client, 5)
    sim.command("unplug")
    until(lambda: client.sensor()["state"] == "no port", "the port to go")
    sim.command("plug")
    pings_until(client, 5)
    check(client.sensor()["reconnects"] == 1, str(client.sensor()))


run([("imagenex_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")],
    parallel=3)
