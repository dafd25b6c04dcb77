#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The Micron over a serial line with faults: a virtual head on a pseudo-terminal, and sonard."""
import time

from lib import check, note, pings_until, run, until
from twin import micron

TURN = 200  # pings of a full circle at 1.8 degrees
TOLERANCE_M = 0.3


def start(bench):
    head = micron(bench)
    bench.conf(sonar={"device": "micron", "mode": "auto"})
    return head, bench.sonard().client()


def blocked(client, azimuth_deg, distance_m):
    return client.call("blocked", azimuth_deg=azimuth_deg, distance_m=distance_m)["state"]


def check_walls(client):
    """A basin from 6 m behind to 9 m ahead and from 5 m left to 4 m right."""
    for azimuth_deg, wall_m in ((0, 9), (90, 4), (180, 6), (270, 5)):
        sector = client.call("sectors", distance_m=0)["sectors"][azimuth_deg // 5]
        check(sector["state"] == "blocked" and abs(sector["range_m"] - wall_m) <= TOLERANCE_M,
              "%g degrees: %s, the wall is at %g m" % (azimuth_deg, sector, wall_m))
        check(blocked(client, azimuth_deg, 0.8 * wall_m) == "clear", "not clear before the wall at %g" % azimuth_deg)
        check(blocked(client, azimuth_deg, wall_m + 0.5) == "blocked", "not blocked behind the wall at %g" % azimuth_deg)


def broken_frames(bench):
    """Only the broken frames are lost."""
    head, client = start(bench)
    pings_until(client, 20)
    for command in ("drop 1", "short 1", "garbage 500", "corrupt 1", "split 1", "motor 1"):
        head.command(command)
        pings_until(client, 10)
    sensor = client.sensor()
    check(sensor["restarts"] == 0, "the head was set up anew: %s" % sensor)
    check(sensor["lost_frames"] == 2, "dropped and short: %s" % sensor)
    check(sensor["garbage_bytes"] >= 500, "the garbage was not counted: %s" % sensor)
    pings_until(client, TURN + 20)
    check_walls(client)


def flood_and_stall(bench):
    head, client = start(bench)
    pings_until(client, 20)
    head.command("flood 1")
    time.sleep(1)
    pings_until(client, 20)
    head.command("stall 2")
    pings_until(client, 20)


def silence(bench):
    """Asked again, told its settings again: said once."""
    head, client = start(bench)
    pings_until(client, 20)
    head.command("silent 7")
    until(lambda: client.sensor()["state"] == "silent", "the silence to be noticed")
    begin = time.monotonic()
    pings_until(client, 10)
    note("pings again %.1f s after the silence was noticed" % (time.monotonic() - begin))
    check(bench.processes[1].log().count("stopped sending pings") == 1, "not said once")


def switched_off_and_on(bench):
    head, client = start(bench)
    pings_until(client, 20)
    head.command("reboot")
    pings_until(client, 20)
    check(client.sensor()["restarts"] == 1, "no restart: %s" % client.sensor())


def unplugged(bench):
    head, client = start(bench)
    pings_until(client, 20)
    head.command("unplug")
    until(lambda: client.sensor()["state"] == "no port", "the loss to be noticed")
    head.command("plug")
    pings_until(client, 20, 60)


def daemon_that_comes_back(bench):
    """The head still scans and says nothing by itself: it is rebooted."""
    _, client = start(bench)
    pings_until(client, 20)
    bench.processes[1].stop()
    client = bench.sonard().client()
    pings_until(client, 20, 60)


cases = [("broken_frames", broken_frames), ("flood_and_stall", flood_and_stall), ("silence", silence),
         ("switched_off_and_on", switched_off_and_on), ("unplugged", unplugged), ("daemon_that_comes_back", daemon_that_comes_back)]

run([("micron_" + name, function) for name, function in cases], parallel=6)
