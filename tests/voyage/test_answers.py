#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Answers about moving, and what answers rest on: a virtual basin from 6 m behind to 9 m ahead, 5 m left to 4 m right."""
import math

from voyage import ping360

from lib import SONARCTL, check, refused, run, until

TURN = 200                    # pings of a full circle at 1.8 degrees
WALLS = {"ahead": 9.0, "right": 4.0, "behind": 6.0, "left": 5.0}
WAYS = {"ahead": (1, 0), "right": (0, 1), "behind": (-1, 0), "left": (0, -1)}
TOLERANCE_M = 0.3             # a layer and a pulse, and the grid's cells across the corridor
BRAKING, LATENCY = 0.2, 0.5   # of the defaults
REACH_M = 0.4 + 0.3           # body and margin
LEVEL = {"attitude_deg": [0, 0, 0]}
STILL = {"attitude_deg": [0, 0, 0], "position_m": [0, 0, 5], "velocity_mps": [0, 0, 0]}


def sail(bench, pose=None, **vehicle):
    """Two turns of pings. The level head sees a fan of 25 degrees: nearer than 4 m it knows nothing of above and below. pose: told
    all along."""
    keys = {"near": "4 m", "latency": "%g s" % LATENCY}
    keys.update(vehicle)
    bench.conf(vehicle=keys, pose={"max_age": "60 s"})
    trip = ping360(bench)
    for _ in range(2 * TURN // 5):
        if pose:
            trip.pose(**pose)
        trip.pings(5)
    return trip


def basin(bench, pose=None, **vehicle):
    client = sail(bench, pose, **vehicle).client()
    states = [s["state"] for s in client.call("sectors", distance_m=0)["sectors"]]
    check(states == 72 * ["blocked"], "walls all around: %s" % states)
    return client


def nearest(bench):
    client = basin(bench)
    answer = client.call("nearest")
    check(answer["state"] == "blocked", "nothing in a basin: %s" % answer)
    check(abs(answer["range_m"] - 4) < TOLERANCE_M, "the nearest wall is at 4 m: %s" % answer)
    check(abs(answer["azimuth_deg"] - 90) < 25, "it is to the right: %s" % answer)
    check(answer["unknown_share"] > 0.2, "above and below are unknown: %s" % answer)
    close = client.call("nearest", distance_m=2)
    check(close["state"] == "unknown" and close["range_m"] is None, "within 2 m: %s" % close)
    def level():
        return client.call("nearest", elevation_deg=[-4, 4], distance_m=2)
    check(level()["state"] == "clear" and level()["unknown_share"] == 0, "within 2 m, level: %s" % level())
    refused(client, "nearest", -32602, elevation_deg=[5, 5])


def cone_and_sector(bench):
    """As sonarctl(1) tells them apart: at 60 degrees the wall to the right comes nearer towards 90, into the wider cone; and an
    obstacle beyond what is asked is told of a sector, and blocks neither that nor a cone."""
    client = sail(bench, pose=STILL).client()
    sector = client.call("sectors", distance_m=4.3)["sectors"][12]
    check((sector["azimuth_deg"], sector["width_deg"], sector["state"]) == (60, 5, "clear"), "%s" % sector)
    wide = client.call("blocked", azimuth_deg=60, distance_m=4.3)
    check(wide["state"] == "blocked" and wide["range_m"] > 4.3 - TOLERANCE_M, "a cone of 15 degrees: %s" % wide)
    narrow = client.call("blocked", azimuth_deg=60, distance_m=4.3, half_angle_deg=2.5)
    check(narrow["state"] == "clear", "as wide as the sector: %s" % narrow)
    bench.processes[-1].stop()
    bench.conf(vehicle={"near": "4 m"}, pose={"max_age": "60 s"}, grid={"clear_for": "1 s"})
    trip = ping360(bench)
    for _ in range(2 * TURN // 5):
        trip.pose(**STILL)
        trip.pings(5)
    client = trip.client()
    sector, cone = client.call("sectors", distance_m=2)["sectors"][0], client.call("blocked", azimuth_deg=0, distance_m=2)
    check(sector["state"] == "unknown" and sector["range_m"] > 8, "a wall behind old water: %s" % sector)
    check(cone["state"] == "unknown" and cone["reason"].startswith("last scan of this direction is"), "%s" % cone)


def limit(bench):
    """Against every wall: what is given stops before it, and more braking way is not wasted."""
    client = basin(bench, unknown="ignore")
    for way, (x, y) in WAYS.items():
        answer = client.call("limit", velocity_mps=[3 * x, 3 * y, 0])
        v = answer["velocity_mps"]
        check(answer["limited_by"] == "blocked", "%s: %s" % (way, answer))
        check(abs(v[0] * y - v[1] * x) < 1e-9 and v[0] * x + v[1] * y >= 0, "%s: turned: %s" % (way, answer))
        check(answer["blocked_m"] <= WALLS[way] - REACH_M + 0.1, "%s: the wall is nearer: %s" % (way, answer))
        check(answer["blocked_m"] >= WALLS[way] - REACH_M - TOLERANCE_M, "%s: timid: %s" % (way, answer))
        speed = math.hypot(*v)
        stop = speed * LATENCY + speed ** 2 / 2 / BRAKING
        check(stop <= answer["blocked_m"] + 1e-6, "%s: does not stop: %s" % (way, answer))
        half = client.call("limit", velocity_mps=[1e-2 * x, 1e-2 * y, 0])
        check(half["limited_by"] == "nothing" and half["velocity_mps"] == [1e-2 * x, 1e-2 * y, 0], "%s" % half)
    rest = client.call("limit", velocity_mps=[0, 0, 0])
    check(rest["speed_mps"] == 0 and rest["limited_by"] == "nothing", "at rest: %s" % rest)
    refused(client, "limit", -32602)
    refused(client, "limit", -32602, velocity_mps=[1, 0])
    out = bench.sonarctl("limit", "--velocity", "3,0,0", "--json")
    check(out.returncode == 0 and '"limited_by":"blocked"' in out.stdout, "sonarctl limit: %s" % out)
    out = bench.sonarctl("limit")
    check(out.returncode == 3 and "--velocity X,Y,Z is missing" in out.stderr, "sonarctl limit: %s" % out)


def drift(bench):
    """Asked to go ahead while it slides towards a wall abeam, or away from it."""
    trip = sail(bench, pose=STILL, unknown="ignore")
    drifts = (-0.8, 0, 0.4, 0.8, 1.7, 2.5)  # 0.8 m/s: 2 m until it is braked; 1.7 m/s: 8 m
    moments = []
    for right in drifts:
        trip.pose(**dict(STILL, velocity_mps=[0, right, 0]))
        trip.run(0.002)
        moments.append(trip.now_s - 0.001)
    at = trip.moments()
    speeds = []
    for right, moment_s in zip(drifts, moments):
        answer = at(moment_s).call("limit", velocity_mps=[3, 0, 0])
        check(answer["limited_by"] == "blocked", "at %g m/s to the right: %s" % (right, answer))
        speeds.append(answer["speed_mps"])
    check(min(speeds[:4]) > 1, "nothing stands in the way so far: %s" % speeds)
    check(sorted(speeds[1:], reverse=True) == speeds[1:], "more drift, more speed: %s" % speeds)
    check(speeds[4] < 0.2, "into the wall to the right: %s" % speeds)
    client = at(trip.now_s)
    refused(client, "limit", -32602, velocity_mps=[1, 0, 0], grid="none")
    refused(client, "time_to_collision", -32602, grid="none")


def old_place(bench):
    """The attitude goes on to be told, place and velocity do not: the vehicle is nearer to the wall by what it has gone."""
    trip = sail(bench, pose=dict(STILL, velocity_mps=[0.5, 0, 0]), unknown="ignore", slow="0 m/s")
    begun_s = trip.now_s
    for _ in range(30):
        trip.pose(**LEVEL)
        trip.run(0.1)
    at = trip.moments()

    def asked(moment_s):
        client = at(moment_s)
        return (client.call("time_to_collision", velocity_mps=[0.5, 0, 0])["time_s"],
                client.call("limit", velocity_mps=[3, 0, 0])["speed_mps"])

    time_s, speed_mps = asked(begun_s)
    later_s, later_mps = asked(begun_s + 3)
    check(later_s <= time_s - 3, "%g s to the wall, 3 s later %g s" % (time_s, later_s))
    check(later_mps < speed_mps - 0.05, "limit: %g m/s, 3 s later %g m/s" % (speed_mps, later_mps))


def attitude_alone(bench):
    """Nothing is clear although nothing stops coming: status says what is missing."""
    trip = sail(bench, pose=LEVEL)
    for _ in range(TURN // 5):
        trip.pose(**LEVEL)
        trip.pings(5)
    client = trip.client()
    states = {s["state"] for s in client.call("sectors", distance_m=2)["sectors"]}
    check("clear" not in states, "clear: %s" % states)
    status = client.call("status")
    check(status["pose"]["drift"].startswith("no position and no depth: ") and status["pose"]["position_m"] is None, str(status["pose"]))
    shown = bench.run(SONARCTL, "--socket", bench.socket_path, "status").stdout
    check("\n             " + status["pose"]["drift"] + "\n" in shown, shown)
    ring = bench.run(SONARCTL, "--socket", bench.socket_path, "sectors", "--distance", "6").stdout
    check("0 clear, " in ring and " unknown: " + status["pose"]["drift"] in ring, ring)
    check("\n             stale after 60 s (attitude)\n" in shown, shown)


def explain_beside_an_uncertain_pose(bench):
    """What the answer counts because the vehicle may be elsewhere by now, or turned, is behind it, and the reason says so."""
    client = sail(bench, pose=LEVEL).client()
    wall = client.call("explain", azimuth_deg=90, distance_m=2)
    check(wall["answer"]["state"] == "blocked" and wall["answer"]["range_m"] > 2, "the wall at 4 m does not block: %s" % wall)
    check(", which may begin at 1." in wall["answer"]["reason"] and "no position and no depth" in wall["answer"]["reason"], "%s" % wall["answer"])
    check(wall["cells"]["all"] > 0 and wall["pings"]["echo"] > 0, "nothing blocks: %s" % wall)
    bench.processes[-1].stop()
    trip = sail(bench, pose=STILL, max_speed="0.2 m/s", max_turn="20 deg")
    trip.run(1)
    client = trip.client()
    at = client.call("explain", azimuth_deg=0, distance_m=3)
    check(at["answer"]["state"] == "unknown", "above and below it never looked: %s" % at)
    check("never observed; since the last pose the vehicle may have moved 0." in at["answer"]["reason"], "%s" % at["answer"])
    check(at["uncertain"]["turned_deg"] > 20 and at["uncertain"]["moved_m"] >= 0.28, "%s" % at["uncertain"])
    out = bench.sonarctl("explain", "0", "--distance", "3")
    check("uncertain pose: all counts nearer and wider by 0." in out.stdout, "sonarctl: %s" % out)


def explain(bench):
    """Ahead stands the wall at 9 m: the pings that say so are those that pointed there, and their bins are where it is."""
    client = basin(bench)
    wall = client.call("explain", azimuth_deg=0, distance_m=12, half_angle_deg=2)
    same = client.call("blocked", azimuth_deg=0, distance_m=12, half_angle_deg=2)
    check(wall["answer"]["state"] == same["state"] == "blocked", "not blocked: %s" % wall)
    cells, pings = wall["cells"]["nearest"], wall["pings"]["newest"]
    check(cells and pings and wall["pings"]["echo"] >= len(pings), "nothing behind it: %s" % wall)
    check([c["near_m"] for c in cells] == sorted(c["near_m"] for c in cells), "the nearest first: %s" % cells)
    check([p["age_s"] for p in pings] == sorted(p["age_s"] for p in pings), "the newest first: %s" % pings)
    numbers = {p["number"] for p in client.call("explain", azimuth_deg=0, distance_m=12, half_angle_deg=2, count=64)
               ["pings"]["newest"]}
    for c in cells:
        check(abs(c["range_m"] - 9) < 1 and c["echoes"] >= 1, "where the wall is not: %s" % c)
        check(c["last_ping"] in numbers, "ping %d is behind a cell, and not told: %s" % (c["last_ping"], numbers))
    for p in pings:
        off = (p["bearing_deg"] + 180) % 360 - 180
        check(p["says"] == "echo" and abs(off) <= 5 and abs(p["range_m"] - 9) < TOLERANCE_M, "it saw it: %s" % p)
    lengths = [p["range_m"] / (p["bin"] + 0.5) for p in pings]
    check(max(lengths) / min(lengths) < 1.01, "ranges and bins disagree: %s" % pings)
    near = client.call("explain", azimuth_deg=90, distance_m=2, half_angle_deg=2)
    check(near["answer"]["state"] == "clear" and near["cells"]["all"] == 0, "nothing within 2 m: %s" % near)
    check(near["pings"]["echo"] == 0 and {p["says"] for p in near["pings"]["newest"]} == {"free"}, "%s" % near["pings"])
    water = client.call("explain", azimuth_deg=0, distance_m=8, half_angle_deg=2)["water"]
    check(water["free_to_m"] > 7.9 and water["records"] > 0 and water["oldest_age_s"] is not None, "%s" % water)
    up = client.call("explain", azimuth_deg=0, elevation_deg=80, distance_m=2)
    check(up["answer"]["state"] == "unknown" and "never observed" in up["answer"]["reason"], "%s" % up)
    check(up["water"] is None and not up["pings"]["newest"], "%s" % up)
    refused(client, "explain", -32602, azimuth_deg=0, distance_m=2, radius_m=1)
    for words, said in ((("explain", "0", "--distance", "12"), "in bin"), (("explain", "90", "--distance", "2"), "free"),
                        (("explain", "0", "--distance", "8", "--half-angle", "2"), "free from 4.00 m to 8.00 m by "),
                        (("explain", "0", "--elevation", "80", "--distance", "8"), "by the records of pings nothing is known to be free"),
                        (("nearest",), "azimuth"), (("limit", "--velocity", "1,0,0"), "limited by"),
                        (("time_to_collision", "--velocity", "1,0,0"), "meets something"),
                        (("time_to_collision", "--velocity", "1,0,0"), "for movement since the scan"),
                        (("sensors",), "mount"),
                        (("grid", "lock", "0"), "cells locked"), (("grid", "unlock", "0"), "cells unlocked")):
        out = bench.sonarctl(*words)
        check(out.returncode == 0 and said in out.stdout and "{" not in out.stdout, "sonarctl %s: %s" % (words, out))


def unknown_ahead(bench):
    """Downwards the head has never looked."""
    for word, wanted in (("slow", 0.07), ("stop", 0), ("ignore", 0.5)):
        client = basin(bench, unknown=word, slow="0.07 m/s", near="auto")
        answer = client.call("limit", velocity_mps=[0, 0, 0.5])
        check(abs(answer["speed_mps"] - wanted) < 1e-3, "unknown = %s: %s" % (word, answer))
        by = "nothing" if word == "ignore" else "unknown"
        check(answer["limited_by"] == by, "unknown = %s: %s" % (word, answer))
        check("never observed" in answer["reason"] and (answer["remedy"] != "") == (by == "unknown"),
              "unknown = %s: %s" % (word, answer))
        client.close()
        bench.processes[-1].stop()


def collision(bench):
    client = basin(bench)
    for way, (x, y) in WAYS.items():
        answer = client.call("time_to_collision", velocity_mps=[0.5 * x, 0.5 * y, 0])
        check(answer["state"] == "blocked", "%s: %s" % (way, answer))
        check(answer["time_s"] <= (WALLS[way] - 0.4) / 0.5 + 0.1, "%s: too late: %s" % (way, answer))
        check(answer["distance_m"] >= WALLS[way] - 0.4 - TOLERANCE_M, "%s: too early: %s" % (way, answer))
        check(answer["time_sd_s"] > 0, "%s: as if it were exact: %s" % (way, answer))
    far = client.call("time_to_collision", velocity_mps=[0.1, 0, 0], ahead_s=2)
    check(far["state"] != "blocked" and far["time_s"] is None, "9 m at 0.1 m/s within 2 s: %s" % far)
    down = client.call("time_to_collision", velocity_mps=[0, 0, 0.5])
    check(down["state"] == "unknown" and down["unknown_after_s"] is not None, "downwards: %s" % down)
    refused(client, "time_to_collision", -32600)
    client.call("watch", method="limit", params={"velocity_mps": [1, 0, 0]}, rate_hz=20)
    until(lambda: client.call("version") and client.notifications, "a limit that is watched")
    check(client.notifications[0]["result"]["asked_mps"] == 1, "watched: %s" % client.notifications[0])


def at_rest(bench):
    client = basin(bench, pose=STILL)
    answer = client.call("time_to_collision")
    check((answer["state"], answer["reason"]) == ("unknown", "the vehicle is at rest"), "at rest: %s" % answer)


def above_the_bottom(bench):
    """In a basin without a floor to hear, what an altimeter says ends free water; once it is silent, nothing does."""
    bench.conf(vehicle={"near": "4 m", "max_speed": "0.2 m/s"}, pose={"max_age": "2 s"})
    trip = ping360(bench)
    for _ in range(TURN // 5):
        trip.pose(**STILL, altitude_m=1)
        trip.pings(5)
    low_s = trip.now_s
    for _ in range(TURN // 5):
        trip.pose(**STILL)
        trip.pings(5)
    at = trip.moments()
    client = at(low_s)
    pose = client.call("status")["pose"]
    check("altitude" in pose["has"] and 0.9 < pose["altitude_m"] <= 1 and pose["position_m"] == STILL["position_m"], "status: %s" % pose)
    low = client.call("blocked", azimuth_deg=0, distance_m=8)
    check(low["state"] == "unknown" and 2 < low["free_to_m"] < 1 / math.sin(math.radians(7.5)), "1 m above it: %s" % low)
    check(low["reason"].startswith("the bottom may begin there, by the altitude of "), "1 m above it: %s" % low)
    check(client.call("blocked", azimuth_deg=0, elevation_deg=9, half_angle_deg=2.5, distance_m=8)["state"] == "clear", "above the horizon")
    dive = client.call("limit", velocity_mps=[0, 0, 0.5])
    check(dive["limited_by"] == "unknown" and "bottom" in dive["reason"] and dive["free_m"] < 0.6, "a dive: %s" % dive)
    client = at(trip.now_s)
    pose = client.call("status")["pose"]
    check("altitude" not in pose["has"] and pose["altitude_m"] is None, "status: %s" % pose)
    check(client.call("blocked", azimuth_deg=0, distance_m=8)["state"] == "clear", "without an altitude")


run([("answers_" + f.__name__, f) for f in (nearest, cone_and_sector, limit, drift, old_place, attitude_alone, explain_beside_an_uncertain_pose, explain, unknown_ahead, collision, at_rest, above_the_bottom)])
