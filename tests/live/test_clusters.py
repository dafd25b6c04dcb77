#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Heads that are steered to where it matters. tests/voyage/test_clusters.py asks what obstacles form together."""
import threading

from lib import PATIENCE, Client, check, pings_until, run
from twin import micron


def apart(a_deg, b_deg):
    return abs((a_deg - b_deg + 180) % 360 - 180)


def steered(bench, **sonar):
    """A vehicle under way northward; the bearings that were pinged."""
    bench.conf(sonar=dict({"step": "3.6 deg", "range": "10 m", "scan": "active"}, **sonar))
    client = bench.sonard().client()
    stop = threading.Event()

    def poses():
        teller = Client(bench.socket_path)
        while not stop.wait(0.1):
            teller.call("pose", attitude_deg=[0, 0, 0], velocity_mps=[0.5, 0, 0])
        teller.close()

    thread = threading.Thread(target=poses)
    thread.start()
    try:
        pings_until(client, 400)
    finally:
        stop.set()
        thread.join()
    bearings = [ping["azimuth_deg"] for ping in bench.truth()]
    sensor = client.sensor()
    check(sensor["restarts"] == 0, str(sensor))
    return bearings


def case_steered(bench):
    bench.sim(truth=True)
    bearings = steered(bench)
    ahead = sum(apart(b, 0) <= 30 for b in bearings)
    astern = sum(apart(b, 180) <= 30 for b in bearings)
    check(astern > 20 and ahead > astern, "%d pings ahead, %d astern" % (ahead, astern))


def case_steered_micron(bench):
    micron(bench)
    bearings = steered(bench, device="micron")
    jumps = sum(apart(a, b) > 15 for a, b in zip(bearings, bearings[1:]))  # one that only scans makes none
    check(jumps >= 4, "the head was sent elsewhere %d times" % jumps)
    check(all(any(apart(b, way) < 10 for b in bearings) for way in range(0, 360, 10)), "a part was left out")
    ahead, astern = (sum(apart(b, way) <= 30 for b in bearings) for way in (0, 180))
    check(ahead > astern, "%d pings ahead, %d astern" % (ahead, astern))


def case_steered_micron_within_its_circle(bench):
    """The whole circle within the time that was set, or in that of a plain one on a slow machine; the rest ahead."""
    circle_s, plain = 12, 100
    micron(bench)
    bearings = steered(bench, device="micron", circle="%g s" % circle_s)
    ahead, astern = (sum(apart(b, way) <= 30 for b in bearings) for way in (0, 180))
    check(ahead > astern > 0, "%d pings ahead, %d astern" % (ahead, astern))
    pings = [(ping["t_ns"] * 1e-9, round(ping["azimuth_deg"] / 10) % 36) for ping in bench.truth()]
    most_s = max(circle_s * PATIENCE, 1.5 * plain * (pings[-1][0] - pings[0][0]) / len(pings))
    last = {}
    for t_s, way in pings:
        wait_s = t_s - last.get(way, t_s)
        check(wait_s < most_s, "%d degrees waited %.1f s of %.1f" % (10 * way, wait_s, most_s))
        last[way] = t_s
    check(len(last) == 36, "a part was left out")


run([("clusters_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")],
    parallel=2)
