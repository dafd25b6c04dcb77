#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""What sonard answers about a scene against what the virtual sonar knows is there: every way to run a Ping360, all threads."""
from voyage import ping360

from lib import check, run
from scene_truth import TURN, check_blocked, check_sectors


def sail(bench, mode, firmware, scene):
    bench.conf(sonar={"mode": mode})
    trip = ping360(bench, "--firmware", firmware, scene=scene, truth=True)
    trip.pings(TURN + 20)
    way = "auto-transmit mode" if mode == "transmit" and firmware == "new" else "polled mode"
    check(way in trip.log(), "the head is not %s: %s" % (way, trip.log()))
    return trip


def of_any_threads(bench, trip, check_answers):
    """The answers are right, and the same with any number of threads."""
    told = []
    for threads in ("0", "1", "2"):
        daemon = trip.daemon("--threads", threads)
        client = daemon.client()
        check_answers(client)
        told.append([client.call("sectors", distance_m=distance_m) for distance_m in (0, 3, 8)])
        client.close()
        daemon.stop()
    check(told[0] == told[1] == told[2], "threads change the answers")


def box(bench, mode, firmware):
    """A basin from 6 m behind to 9 m ahead and from 5 m left to 4 m right."""
    def answers(client):
        count = check_sectors(client, bench)
        check(count["blocked"] == 72, "of 72 sectors between walls only %s" % count)
        for azimuth_deg, wall_m in ((0, 9), (90, 4), (180, 6), (270, 5)):
            check_blocked(bench, client, azimuth_deg, 0.8 * wall_m, "clear")
            check_blocked(bench, client, azimuth_deg, wall_m + 0.5, "blocked")
    of_any_threads(bench, sail(bench, mode, firmware, "box"), answers)


def pile(bench, mode, firmware):
    """A pile of 0.8 m at 18.4 degrees, its near side at 5.92 m; nothing else."""
    def answers(client):
        count = check_sectors(client, bench)
        check(count["clear"] >= 66, "of 72 sectors in open water with a pile only %s" % count)
        check_blocked(bench, client, 18.4, 5, "clear")
        check_blocked(bench, client, 18.4, 7, "blocked")
        check_blocked(bench, client, 120, 9, "clear")
        check_blocked(bench, client, 120, 15, "unknown")
    of_any_threads(bench, sail(bench, mode, firmware, "pile"), answers)


def crossing(bench):
    """A pile of 0.8 m crosses 5 m ahead, from the left, at 0.5 m/s: what it has left is free again once that has faded."""
    bench.conf(sonar={"sector": "315 45 deg"}, grid={"clear_for": "4 s", "forget": "4 s"})
    trip = ping360(bench, "--ghost", "0", scene=bench.write("crossing", "pile 5 -2 0.4 0 0.5\n"))
    trip.run(11)  # the pile has come from 22 degrees to the left to 35 to the right; 5 s ago it was at 11
    client = trip.client()
    check_blocked(bench, client, 35, 8, "blocked")
    for sector in client.call("sectors", distance_m=0)["sectors"]:
        check(sector["state"] != "blocked" or 10 < sector["azimuth_deg"] < 50, "the pile has left: %s" % sector)
    ahead = client.call("blocked", azimuth_deg=0, distance_m=8, half_angle_deg=1)
    check(ahead["state"] == "clear", "the pile was ahead 7 s ago: %s" % ahead)


WAYS = (("transmit", "new"), ("request", "new"), ("transmit", "old"), ("request", "old"))

cases = [("scene_crossing", crossing)]
for scene in (box, pile):
    for way in WAYS:
        cases.append(("scene_%s_%s_%s" % (scene.__name__, *way), lambda bench, s=scene, w=way: s(bench, *w)))

run(cases)
