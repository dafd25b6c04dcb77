#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""What obstacles form together and where to look next, asked of a running daemon; a Ping360 that is steered."""
import math
import threading

from lib import PATIENCE, Client, RpcError, check, pings_until, run, until
from twin import Twin, micron


def basin(bench, threads=0):
    """From 6 m behind to 9 m ahead and from 5 m left to 4 m right; the sonar sweeps the half ahead."""
    Twin(bench, "echolist_sim", "--from", "-90", "--to", "90")
    bench.conf(sonar={"device": "echolist", "range": "20 m", "step": "3 deg", "mode": "auto"},
               pipeline={"threads": threads})
    client = bench.sonard().client()
    pings_until(client, 130)
    return client


def apart(a_deg, b_deg):
    return abs((a_deg - b_deg + 180) % 360 - 180)


def case_walls(bench):
    client = basin(bench, 2)
    result = client.call("clusters")
    check(result["frame"] == "body" and result["pose"] == "not needed" and 1 <= result["all"] == len(result["clusters"]), str(result))
    nearest = result["clusters"][0]
    check(abs(nearest["near_m"] - 4) < 0.4, str(nearest))
    check(nearest["echoes"] >= nearest["cells"] >= nearest["seeds"] > 0, str(nearest))
    for azimuth_deg, distance_m in ((90, 4), (270, 5)):
        check(any(apart(w["normal_deg"], azimuth_deg) < 8 and abs(w["distance_m"] - distance_m) < 0.4
                  for w in result["walls"]), "no wall at %g degrees: %s" % (azimuth_deg, result["walls"]))
    labels = {cluster["label"] for cluster in result["clusters"]}
    pings_until(client, 200)
    again = client.call("clusters")
    check(labels & {cluster["label"] for cluster in again["clusters"]}, "no label lasts: %s, %s" % (labels, again))
    check(len(client.call("clusters", count=1)["clusters"]) == 1, "count = 1")
    check("nearest first" in bench.sonarctl("clusters").stdout, "sonarctl clusters")


def case_next_look(bench):
    client = basin(bench, 2)
    looks = client.call("next_look", count=3, apart_deg=20)["directions"]
    check(len(looks) == 3 and all(90 < look["azimuth_deg"] < 270 and look["why"] == "never observed"
                                  for look in looks), str(looks))
    for wrong in ({"count": 0}, {"count": 65}, {"elevation_deg": [5, -5]}, {"apart": 1}):
        try:
            client.call("next_look", **wrong)
            check(False, "%s was taken" % wrong)
        except RpcError:
            pass


def case_locked(bench):
    """What is locked blocks long after the sonar went silent and all else was forgotten."""
    sim = bench.sim()
    bench.conf(sonar={"step": "3.6 deg", "range": "10 m"}, grid={"forget": "4 s", "clear_for": "2 s"})
    client = bench.sonard().client()
    pings_until(client, 130)
    for wrong in ({}, {"azimuth_deg": 0, "locked": 1}, {"azimuth_deg": 0, "from_m": 2, "to_m": 1}):
        try:
            client.call("grid_lock", **wrong)
            check(False, "%s was taken" % wrong)
        except RpcError:
            pass
    check(client.call("grid_lock", azimuth_deg=90, to_m=0.1)["cells"] == 0, "cells where nothing is")
    locked = client.call("grid_lock", azimuth_deg=90)
    check(locked["cells"] > 0 and locked["locked"], str(locked))
    sim.command("silent 1000")
    state = lambda azimuth_deg: client.call("blocked", azimuth_deg=azimuth_deg, distance_m=9)["state"]
    check(state(90) == "blocked" and state(270) == "blocked", "walls to both sides")
    until(lambda: state(270) == "unknown", "the wall that is not locked to be forgotten")
    check(state(90) == "blocked", "the locked wall is still there")
    told = bench.sonarctl("grid", "unlock", "90")
    check(told.returncode == 0 and "%d cells unlocked" % locked["cells"] in told.stdout, told.stdout + told.stderr)
    check(state(90) == "unknown", "unlocked, it is as old as the other one")


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
    bearings = steered(bench, device="micron", mode="auto")
    jumps = sum(apart(a, b) > 15 for a, b in zip(bearings, bearings[1:]))  # one that only scans makes none
    check(jumps >= 4, "the head was sent elsewhere %d times" % jumps)
    check(all(any(apart(b, way) < 10 for b in bearings) for way in range(0, 360, 10)), "a part was left out")
    ahead, astern = (sum(apart(b, way) <= 30 for b in bearings) for way in (0, 180))
    check(ahead > astern, "%d pings ahead, %d astern" % (ahead, astern))


def case_steered_micron_within_its_circle(bench):
    """The whole circle within the time that was set, or in that of a plain one on a slow machine; the rest ahead."""
    circle_s, plain = 12, 100
    micron(bench)
    bearings = steered(bench, device="micron", mode="auto", circle="%g s" % circle_s)
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


def case_gone(bench):
    """A pile that crosses ahead leaves what it was as a cluster that is gone, with the reason."""
    bench.sim("--ghost", "0", scene=bench.write("crossing", "pile 5 -2 0.4 0 0.5\n"))
    bench.conf(sonar={"sector": "315 45 deg", "range": "10 m"}, grid={"clear_for": "4 s", "forget": "6 s"})
    client = bench.sonard().client()
    until(lambda: client.call("clusters")["clusters"], "the pile to be seen")
    gone = until(lambda: client.call("clusters")["gone"], "the pile to be gone", 60)[0]
    check(gone["why"] != "out of reach" and gone["cells"] > 0, "the vehicle stands still: %s" % gone)
    north_m = gone["range_m"] * math.cos(math.radians(gone["azimuth_deg"]))
    check(abs(north_m - 4.8) < 0.6, "not on the pile's way, 5 m ahead: %s" % gone)


def place(g):
    """North and east of something that is gone, from the grid's centre."""
    return [g["range_m"] * f(math.radians(g["azimuth_deg"])) for f in (math.cos, math.sin)]


def case_what_a_cell_went_through(bench):
    """A pile crosses ahead: explain tells which cells appeared and were missed, and which are gone, while the turn lasts."""
    bench.sim("--ghost", "0", scene=bench.write("crossing", "pile 5 -2 0.4 0 0.3\n"))
    bench.conf(sonar={"sector": "315 45 deg", "range": "10 m"}, grid={"clear_for": "4 s", "forget": "60 s"})
    client = bench.sonard().client()
    turns, misses = set(), set()

    def gone():
        told = client.call("explain", azimuth_deg=0, distance_m=8, half_angle_deg=40, count=64)
        turns.update(cell["turn"] for cell in told["cells"]["nearest"])
        misses.update(cell["misses"] for cell in told["cells"]["nearest"])
        check(not any(cell["locked"] for cell in told["cells"]["nearest"]), "nobody locked any: %s" % told)
        return told["gone"]["newest"]

    until(lambda: gone() and len(misses) > 1 and {"appeared", "missed"} <= turns, "cells to appear and to be missed", 60)
    found = until(gone, "cells to be gone", 60)
    for g in found:
        north_m = place(g)[0]
        check(g["misses"] > 0 and g["echoes"] > 0 and abs(north_m - 4.8) < 1, "not on the pile's way: %s" % g)
    until(lambda: "gone in this turn" in bench.sonarctl("explain", "0", "--distance", "8", "--half-angle", "40").stdout,
          "sonarctl to tell of cells that are gone", 60)
    client.call("grid_lock", azimuth_deg=0, half_angle_deg=40)
    told = client.call("explain", azimuth_deg=0, distance_m=8, half_angle_deg=20)
    check(all(cell["locked"] for cell in told["cells"]["nearest"]), "all were locked: %s" % told)
    check(sum(cluster["locked"] for cluster in client.call("clusters")["clusters"]) > 0, "clusters of locked cells")


def case_rounds_a_corner(bench):
    """The vehicle passes behind a block: the pile that it heard is told as hidden, at the place where it stands."""
    sim = bench.sim("--ghost", "0", scene=bench.write("corner", "pile 7 0 0.3 0 0\nbox 3 3.4 0.4 9 -9 9\n"))
    bench.conf(sonar={"sector": "300 60 deg", "range": "10 m"}, grid={"clear_for": "4 s", "forget": "6 s"})
    client = bench.sonard().client()

    def heard_at(east_m, what):
        sim.command("pose 0 %g 0 0" % east_m)
        client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, east_m, 0])
        return client.call("clusters")[what]

    until(lambda: any(apart(c["nearest"]["azimuth_deg"], 0) < 6 and c["near_m"] > 6 for c in heard_at(0, "clusters")),
          "the pile to be heard")
    for step in range(1, 25):
        heard_at(0.05 * step, "clusters")
        pings_until(client, 4)

    def hidden():
        return [g for g in heard_at(1.2, "gone") if math.dist(place(g), (6.7, -1.2)) < 1]

    why = until(hidden, "the pile to be gone", 60)[0]["why"]
    check(why == "behind something nearer", "the block stands before it: %s" % why)
    check("behind something nearer" in bench.sonarctl("clusters").stdout, "sonarctl clusters")


run([("clusters_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")],
    parallel=2)
