#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Echo lists over a serial line with faults: a virtual sweep sonar on a pseudo-terminal, and sonard."""
from lib import pings_until, run, until
from twin import Twin


def start(bench, *arguments, **keys):
    sim = Twin(bench, "echolist_sim", "--from", "-90", "--to", "90", *arguments)
    conf = {"device": "echolist", "range": "20 m"}
    conf.update(keys)
    bench.conf(sonar=conf)
    return sim, bench.sonard().client()


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
