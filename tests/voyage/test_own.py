#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""A bar of the vehicle's own frame, 0.8 m from the head: what it is taken for before and after the vehicle has turned."""
from voyage import ping360

from lib import check, run
from scene_truth import TURN

BAR_DEG, BAR_M = 200, 0.8
FRAME = ("--frame", "%g,20,%g" % (BAR_DEG, BAR_M))
STEP = 5  # pings from one pose to the next


def sail(bench, turns, turn_deg):
    """So many turns of the head while the vehicle turns on the spot so far in each, then two turns without."""
    bench.conf(pose={"max_age": "60 s"})
    trip = ping360(bench, *FRAME)
    steps = turns * TURN // STEP
    for n in range(steps + 2 * TURN // STEP):
        trip.place(0, 0, 2, yaw_deg=min(n, steps) * turn_deg * STEP / TURN % 360)
        trip.pings(STEP)
    return trip


def marks(client):
    """Of the echoes of the bar, and of all others but for those at its ends."""
    bar, rest = [], []
    for row in client.call("image", sensor="head")["rows"]:
        for echo in row["echoes"]:
            aside_deg, off_m = abs(row["azimuth_deg"] - BAR_DEG), abs(echo["range_m"] - BAR_M)
            if aside_deg < 8 and off_m < 0.2:
                bar.append(echo["marks"])
            elif aside_deg > 13 or off_m > 0.3:
                rest.append(echo["marks"])
    return bar, rest


def states(client):
    return [client.call("blocked", azimuth_deg=azimuth_deg, distance_m=distance_m)["state"]
            for azimuth_deg in range(0, 360, 5) for distance_m in (0.6, 1.5, 3, 12)]


def turned(bench):
    """It is marked as the vehicle's own and blocks no more; the water behind it is unknown; walls stay walls. With any threads."""
    trip = sail(bench, 8, 45)
    told = []
    for threads in ("0", "1", "2"):
        daemon = trip.daemon("--threads", threads)
        client = daemon.client()
        bar, rest = marks(client)
        check(bar and all("own" in m for m in bar), "the bar: %s" % bar)
        check(rest and not any("own" in m for m in rest), "own echoes elsewhere: %s" % rest)
        check(client.sensor()["own_bearings"] >= 8, "status: %s" % client.sensor())
        for distance_m in (1.5, 3):
            answer = client.call("blocked", azimuth_deg=BAR_DEG, distance_m=distance_m)
            check(answer["state"] == "unknown", "behind the bar: %s" % answer)
            check(": hidden by the vehicle's own echo" in answer["reason"], "why: %s" % answer)
        aside = client.call("blocked", azimuth_deg=BAR_DEG - 90, distance_m=12)
        check("own echo" not in aside["reason"], "no bar is there: %s" % aside)
        pings = client.call("explain", azimuth_deg=BAR_DEG, half_angle_deg=4, distance_m=1.5)["pings"]
        check(pings["own"] > 0 and pings["newest"][0]["says"] == "own", "explain: %s" % pings)
        told.append(states(client))
        client.close()
        daemon.stop()
    check(told[0] == told[1] == told[2], "threads change the answers")


def still(bench):
    """Without a turn of the vehicle it is an obstacle like any other."""
    client = sail(bench, 8, 0).client()
    bar, rest = marks(client)
    check(bar and not any("own" in m for m in bar + rest), "marks: %s, %s" % (bar, rest))
    check(client.sensor()["own_bearings"] == 0, "status: %s" % client.sensor())
    answer = client.call("blocked", azimuth_deg=BAR_DEG, distance_m=1.5)
    check(answer["state"] == "blocked" and abs(answer["range_m"] - BAR_M) < 0.2, "the bar: %s" % answer)


run([("own_turned", turned), ("own_still", still)])
