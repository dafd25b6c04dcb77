#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The Micron over a real line: a virtual head on a pseudo-terminal, and sonard. What goes wrong on the line is
tests/unit/daemon/test_rig_line.c's."""
from lib import pings_until, run, until
from twin import micron


def start(bench):
    head = micron(bench)
    bench.conf(sonar={"device": "micron", "step": "1.8 deg"})
    return head, bench.sonard().client()


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


run([("micron_unplugged", unplugged), ("micron_daemon_that_comes_back", daemon_that_comes_back)], parallel=2)
