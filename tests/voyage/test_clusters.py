#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""What obstacles form together, where to look next, and what became of what is gone."""
import math

from voyage import Voyage, ping360

from lib import check, refused, run


def basin(bench, pings):
    """From 6 m behind to 9 m ahead and from 5 m left to 4 m right; the sonar sweeps the half ahead."""
    bench.conf(sonar={"device": "echolist", "range": "20 m"}, pipeline={"threads": 2})
    trip = Voyage(bench, "echolist_sim", "--from", "-90", "--to", "90")
    trip.pings(pings)
    return trip


def apart(a_deg, b_deg):
    return abs((a_deg - b_deg + 180) % 360 - 180)


def case_walls(bench):
    at = basin(bench, 330).moments()
    client = at(6.5)  # 130 pings
    result = client.call("clusters")
    check(result["frame"] == "body" and result["pose"] == "not needed" and 1 <= result["all"] == len(result["clusters"]), str(result))
    nearest = result["clusters"][0]
    check(abs(nearest["near_m"] - 4) < 0.2, str(nearest))
    check(nearest["echoes"] >= nearest["cells"] >= nearest["seeds"] > 0, str(nearest))
    for azimuth_deg, distance_m in ((90, 4), (270, 5)):
        check(any(apart(w["normal_deg"], azimuth_deg) < 8 and abs(w["distance_m"] - distance_m) < 0.3
                  for w in result["walls"]), "no wall at %g degrees: %s" % (azimuth_deg, result["walls"]))
    check(len(client.call("clusters", count=1)["clusters"]) == 1, "count = 1")
    check("nearest first" in bench.sonarctl("clusters").stdout, "sonarctl clusters")
    labels = {cluster["label"] for cluster in result["clusters"]}
    again = at(16.5).call("clusters")
    check(labels & {cluster["label"] for cluster in again["clusters"]}, "no label lasts: %s, %s" % (labels, again))


def case_next_look(bench):
    client = basin(bench, 130).client()
    looks = client.call("next_look", count=3, apart_deg=20)["directions"]
    check(len(looks) == 3 and all(90 < look["azimuth_deg"] < 270 and look["why"] == "never observed"
                                  for look in looks), str(looks))
    for wrong in ({"count": 0}, {"count": 65}, {"elevation_deg": [5, -5]}, {"apart": 1}):
        refused(client, "next_look", **wrong)


def case_locked(bench):
    """What is locked blocks long after the sonar went silent and all else was forgotten."""
    bench.conf(sonar={"step": "3.6 deg", "range": "10 m"}, grid={"forget": "4 s", "clear_for": "2 s"})
    trip = ping360(bench)
    trip.pings(130)
    heard_s = trip.now_s
    trip.sonar("silent 1000")
    trip.run(6)
    at = trip.moments()
    client = at(heard_s)
    for wrong in ({}, {"azimuth_deg": 0, "locked": 1}, {"azimuth_deg": 0, "from_m": 2, "to_m": 1}):
        refused(client, "grid_lock", **wrong)
    check(client.call("grid_lock", azimuth_deg=90, to_m=0.1)["cells"] == 0, "cells where nothing is")
    locked = client.call("grid_lock", azimuth_deg=90)
    check(locked["cells"] > 0 and locked["locked"], str(locked))

    def states(client):
        return [client.call("blocked", azimuth_deg=azimuth_deg, distance_m=9)["state"] for azimuth_deg in (90, 270)]
    check(states(client) == ["blocked", "blocked"], "walls to both sides: %s" % states(client))
    client = at(trip.now_s)
    check(states(client) == ["blocked", "unknown"], "only the wall that is locked is still there: %s" % states(client))
    told = bench.sonarctl("grid", "unlock", "90")
    check(told.returncode == 0 and "%d cells unlocked" % locked["cells"] in told.stdout, told.stdout + told.stderr)
    check(states(client) == ["unknown", "unknown"], "unlocked, it is as old as the other one")


def crossing(bench, speed_mps, forget_s, until_s):
    """A pile crosses 5 m ahead, from 2 m to the left."""
    bench.conf(sonar={"sector": "315 45 deg", "range": "10 m"}, grid={"clear_for": "4 s", "forget": "%g s" % forget_s})
    trip = ping360(bench, "--ghost", "0", scene=bench.write("crossing", "pile 5 -2 0.4 0 %g\n" % speed_mps))
    trip.run(until_s)
    return trip.moments()


def case_gone(bench):
    """A pile that crosses ahead leaves what it was as a cluster that is gone, with the reason."""
    at = crossing(bench, 0.5, 6, 16)
    check(at(3).call("clusters")["clusters"], "the pile is not seen")
    gone = []
    for s in range(4, 17):
        gone += at(s).call("clusters")["gone"]
    check(gone and all(g["why"] != "out of reach" and g["cells"] > 0 for g in gone), "the vehicle stands still: %s" % gone)
    check(all(abs(place(g)[0] - 4.8) < 0.6 for g in gone), "not on the pile's way, 5 m ahead: %s" % gone)


def place(g):
    """North and east of something that is gone, from the grid's centre."""
    return [g["range_m"] * f(math.radians(g["azimuth_deg"])) for f in (math.cos, math.sin)]


def case_what_a_cell_went_through(bench):
    """A pile crosses ahead: explain tells which cells appeared and were missed, and which are gone, while the turn lasts."""
    at = crossing(bench, 0.3, 60, 20)
    turns, misses, gone, told_gone = set(), set(), [], False
    for quarter in range(8, 80):
        told = at(quarter / 4).call("explain", azimuth_deg=0, distance_m=8, half_angle_deg=40, count=64)
        turns.update(cell["turn"] for cell in told["cells"]["nearest"])
        misses.update(cell["misses"] for cell in told["cells"]["nearest"])
        check(not any(cell["locked"] for cell in told["cells"]["nearest"]), "nobody locked any: %s" % told)
        if told["gone"]["newest"] and not gone:
            words = bench.sonarctl("explain", "0", "--distance", "8", "--half-angle", "40").stdout
            told_gone = "gone in this turn" in words
        gone += told["gone"]["newest"]
    check(len(misses) > 1 and {"appeared", "missed"} <= turns, "%s, missed %s" % (turns, misses))
    check(gone and told_gone, "nothing is gone, or sonarctl does not tell: %s" % gone)
    for g in gone:
        check(g["misses"] > 0 and g["echoes"] > 0 and abs(place(g)[0] - 4.8) < 1, "not on the pile's way: %s" % g)
    client = at(20)
    client.call("grid_lock", azimuth_deg=0, half_angle_deg=40)
    told = client.call("explain", azimuth_deg=0, distance_m=8, half_angle_deg=20)
    check(all(cell["locked"] for cell in told["cells"]["nearest"]), "all were locked: %s" % told)
    check(sum(cluster["locked"] for cluster in client.call("clusters")["clusters"]) > 0, "clusters of locked cells")


def case_rounds_a_corner(bench):
    """The vehicle passes behind a block: the pile that it heard is told as hidden, at the place where it stands."""
    bench.conf(sonar={"sector": "300 60 deg", "range": "10 m"}, grid={"clear_for": "4 s", "forget": "6 s"})
    trip = ping360(bench, "--ghost", "0", scene=bench.write("corner", "pile 7 0 0.3 0 0\nbox 3 3.4 0.4 9 -9 9\n"))
    for step in range(180):  # stands 3 s, goes 1.2 m to the right in 2.4 s, stands again
        trip.place(0, min(max(0, step - 30) * 0.05, 1.2), 0)
        trip.run(0.1)
    at = trip.moments()
    heard = at(3).call("clusters")["clusters"]
    check(any(apart(c["nearest"]["azimuth_deg"], 0) < 6 and c["near_m"] > 6 for c in heard), "the pile is not heard: %s" % heard)
    gone, words = [], ""
    for tenth in range(31, 180, 3):
        found = at(tenth / 10).call("clusters")["gone"]
        gone += [g for g in found if math.dist(place(g), (6.7, -1.2)) < 1]
        words += bench.sonarctl("clusters").stdout if gone and not words else ""
    check(gone and all(g["why"] == "behind something nearer" for g in gone), "the block stands before it: %s" % gone)
    check("behind something nearer" in words, "sonarctl clusters: %s" % words)


run([("clusters_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")])
