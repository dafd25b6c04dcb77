#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Answers about moving, and what answers rest on: a virtual basin from 6 m behind to 9 m ahead, 5 m left to 4 m right."""
import json
import math
import re
import time

from lib import SONARD, RpcError, check, pings_until, run, until
from made_capture import MadeCapture

TURN = 200                    # pings of a full circle at 1.8 degrees
WALLS = {"ahead": 9.0, "right": 4.0, "behind": 6.0, "left": 5.0}
WAYS = {"ahead": (1, 0), "right": (0, 1), "behind": (-1, 0), "left": (0, -1)}
TOLERANCE_M = 0.4             # a layer and a pulse, and the grid's cells across the corridor
BRAKING, LATENCY = 0.2, 0.5   # of the defaults
REACH_M = 0.4 + 0.3           # body and margin


def basin(bench, pose=None, **vehicle):
    """The level head sees a fan of 25 degrees: nearer than 4 m it knows nothing of above and below. pose: told all along."""
    keys = {"near": "4 m", "latency": "%g s" % LATENCY}
    keys.update(vehicle)
    bench.sim()
    bench.conf(vehicle=keys, pose={"max_age": "60 s"})
    client = bench.sonard().client()
    if pose:
        until(lambda: client.call("pose", **pose) and client.sensor()["pings"] > TURN + 20, "a turn of pings", 60)
    pings_until(client, TURN + 20)
    until(lambda: (not pose or client.call("pose", **pose)) and all(s["state"] == "blocked" for s in client.call("sectors", distance_m=0)["sectors"]), "all of the circle", 60)
    return client


def refused(client, method, code, **params):
    try:
        client.call(method, **params)
    except RpcError as error:
        check(error.code == code, "%s: code %d, want %d: %s" % (method, error.code, code, error))
        return str(error)
    check(False, "%s was not refused" % method)


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
    until(lambda: level()["state"] == "clear", "the level water within 2 m to be clear", 60)
    check(level()["unknown_share"] == 0, "within 2 m, level: %s" % level())
    refused(client, "nearest", -32602, elevation_deg=[5, 5])


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
    still = {"attitude_deg": [0, 0, 0], "position_m": [0, 0, 5], "velocity_mps": [0, 0, 0]}
    client = basin(bench, pose=still, unknown="ignore")
    speeds = []
    for right in (-0.8, 0, 0.4, 0.8, 1.7, 2.5):     # 0.8 m/s: 2 m until it is braked; 1.7 m/s: 8 m
        client.call("pose", **dict(still, velocity_mps=[0, right, 0]))
        answer = client.call("limit", velocity_mps=[3, 0, 0])
        check(answer["limited_by"] == "blocked", "at %g m/s to the right: %s" % (right, answer))
        speeds.append(answer["speed_mps"])
    check(min(speeds[:4]) > 1, "nothing stands in the way so far: %s" % speeds)
    check(sorted(speeds[1:], reverse=True) == speeds[1:], "more drift, more speed: %s" % speeds)
    check(speeds[4] < 0.2, "into the wall to the right: %s" % speeds)
    refused(client, "limit", -32602, velocity_mps=[1, 0, 0], grid="none")
    refused(client, "time_to_collision", -32602, grid="none")


def old_place(bench):
    """The attitude goes on to be told, place and velocity do not: the vehicle is nearer to the wall by what it has gone."""
    level, moves = {"attitude_deg": [0, 0, 0]}, {"position_m": [0, 0, 5], "velocity_mps": [0.5, 0, 0]}
    client = basin(bench, pose=dict(level, **moves), unknown="ignore", slow="0 m/s")

    def asked():
        client.call("pose", **level)
        return (client.call("time_to_collision", velocity_mps=[0.5, 0, 0])["time_s"],
                client.call("limit", velocity_mps=[3, 0, 0])["speed_mps"])

    client.call("pose", **dict(level, **moves))
    time_s, speed_mps = asked()
    begun = time.monotonic()
    time.sleep(3)
    waited_s = time.monotonic() - begun
    later_s, later_mps = asked()
    check(later_s < time_s - waited_s + 0.2, "%g s to the wall, %g s later %g s" % (time_s, waited_s, later_s))
    check(later_mps < speed_mps - 0.05, "limit: %g m/s, %g s later %g m/s" % (speed_mps, waited_s, later_mps))


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
    check(near["directions"]["never"] == 0 and near["directions"]["oldest"]["age_s"] >= near["answer"]["age_s"] - 1,
          "%s" % near["directions"])
    up = client.call("explain", azimuth_deg=0, elevation_deg=80, distance_m=2)
    check(up["answer"]["state"] == "unknown" and up["directions"]["never"] == up["directions"]["all"] > 0, "%s" % up)
    check(up["directions"]["oldest"] is None and not up["pings"]["newest"], "%s" % up)
    refused(client, "explain", -32602, azimuth_deg=0, distance_m=2, radius_m=1)
    for words, said in ((("explain", "0", "--distance", "12"), "in bin"), (("explain", "90", "--distance", "2"), "free"),
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
        other = type(bench)()
        try:
            other.sim()
            other.conf(vehicle={"unknown": word, "slow": "0.07 m/s"})
            client = other.sonard().client()
            pings_until(client, 20)
            answer = client.call("limit", velocity_mps=[0, 0, 0.5])
            check(abs(answer["speed_mps"] - wanted) < 1e-3, "unknown = %s: %s" % (word, answer))
            by = "nothing" if word == "ignore" else "unknown"
            check(answer["limited_by"] == by, "unknown = %s: %s" % (word, answer))
            check("never observed" in answer["reason"] and (answer["remedy"] != "") == (by == "unknown"),
                  "unknown = %s: %s" % (word, answer))
        finally:
            faults = other.end()
        check(not faults, "; ".join(faults))


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
    client.call("pose", velocity_mps=[0, 0, 0], attitude_deg=[0, 0, 0])
    at_rest = client.call("time_to_collision")
    check((at_rest["state"], at_rest["reason"]) == ("unknown", "the vehicle is at rest"), "at rest: %s" % at_rest)
    client.call("watch", method="limit", params={"velocity_mps": [1, 0, 0]}, rate_hz=20)
    until(lambda: client.call("version") and client.notifications, "a limit that is watched")
    check(client.notifications[0]["result"]["asked_mps"] == 1, "watched: %s" % client.notifications[0])


def stats(bench):
    """The same numbers as in status, and the text as Prometheus reads it."""
    client = basin(bench)
    metrics = {m["name"]: m for m in client.call("stats")["metrics"]}
    sensor = client.call("sensors")["sensors"][0]
    pings = metrics["sonard_sensor_pings_total"]["samples"][0]
    check(pings["labels"] == {"sensor": "head"} and TURN <= pings["value"] <= sensor["pings"], "pings: %s" % pings)
    check(sensor["heard"] is True and sensor["mount_m"] == [0, 0, 0], "sensors: %s" % sensor)
    stages = {s["labels"]["stage"]: s for s in metrics["sonard_latency_seconds"]["samples"]}
    check(sorted(stages) == ["extract", "maps", "ping_to_picture", "request"], "stages: %s" % sorted(stages))
    for name, stage in stages.items():
        counts = [n for _, n in stage["buckets"]]
        check(counts == sorted(counts) and counts[-1] == stage["count"] > 0, "%s: %s" % (name, stage))
        check(0 < stage["p50_us"] <= stage["p99_us"] <= stage["max_us"], "%s: %s" % (name, stage))
        check(stage["sum_s"] <= stage["count"] * stage["max_us"] * 1e-6 * 1.001, "%s: %s" % (name, stage))
    text = bench.sonarctl("stats", "--prometheus").stdout
    typed, values = set(), {}
    for line in text.splitlines():
        if line.startswith("# TYPE "):
            typed.add(line.split()[2])
        elif not line.startswith("# HELP "):
            match = re.fullmatch(r'([a-z_0-9]+)(\{[a-z_]+="[^"]*"(?:,[a-z_]+="[^"]*")*\})? ([0-9.e+-]+)', line)
            check(match, "no sample: %r" % line)
            name = re.sub("_(bucket|sum|count)$", "", match.group(1)) if "latency" in line else match.group(1)
            check(name in typed, "%s has no type" % name)
            values[match.group(1) + (match.group(2) or "")] = float(match.group(3))
    check(values['sonard_sensor_pings_total{sensor="head"}'] >= pings["value"], "pings went backwards")
    check(values['sonard_latency_seconds_bucket{stage="maps",le="+Inf"}'] ==
          values['sonard_latency_seconds_count{stage="maps"}'], "the last bucket is not all")
    check("sonard_pings_total" in bench.sonarctl("stats").stdout, "sonarctl stats")


def ray(bench):
    """A cone of no width is a question like any other, also along the border of two directions."""
    client = bench.sonard("--replay", "tests/replay/box.mcap", "--stay", "--socket", bench.socket_path,
                          conf=False).client()
    until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay")
    known = 0
    for azimuth_deg in range(0, 360):
        of_ray, of_cone = [client.call("blocked", azimuth_deg=azimuth_deg, distance_m=2, half_angle_deg=half_angle_deg)
                           for half_angle_deg in (0, 0.01)]
        check("outside" not in of_ray["reason"], "%d: %s" % (azimuth_deg, of_ray))
        check(of_ray["state"] == of_cone["state"], "%d: %s, %s" % (azimuth_deg, of_ray, of_cone))
        known += of_ray["state"] != "unknown"
    check(known > 50, "only %d rays are known" % known)


def doubted(bench):
    """A depth above the surface is taken, and told."""
    bench.sim()
    bench.conf()
    daemon = bench.sonard()
    client = daemon.client()
    client.call("pose", attitude_deg=[0, 0, 0], depth_m=-5)
    until(lambda: "depth_m = -5 is above the surface" in daemon.log(), "the warning")


def radians(bench):
    """An attitude that is in radians by the looks of it for more than a minute is taken, and told; one in degrees is not."""
    conf = bench.conf()
    for name, heading, told in (("radians", 3.1, True), ("degrees", 178, False)):
        made = MadeCapture(bench.path(name), ("/pose", "json"))
        for second in range(70):
            pose = {"t_unix": 1.7e9 + second, "attitude_deg": [0.05, -0.1, heading]}
            made.write([(1, (1700000000 + second) * 10**9, json.dumps(pose).encode())])
        made.end()
        said = bench.run(SONARD, "--replay", bench.path(name), "-c", conf, "--socket", "none").stderr
        check(("send degrees, not radians" in said) == told, "%s: %s" % (name, said))


def unmeasured(bench):
    """A replay measures no latency, and says nothing of it rather than 0."""
    daemon = bench.sonard("--replay", "tests/replay/box.mcap", "--stay", "--socket", bench.socket_path, conf=False)
    client = daemon.client()
    until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay")
    check(client.call("status")["pipeline"]["latency_us"] is None, client.call("status")["pipeline"])
    said = bench.sonarctl("status").stdout
    check("0 pings dropped\n" in said, said)
    check("none given: the vehicle counts as standing still" in said and "keep sending" not in said, said)
    judged = bench.sonarctl("sectors", "--distance", "1.5").stdout.splitlines()[0]
    check("azimuth clockwise from forward, judged to 1.50 m, no pose" in judged, judged)
    check(" 0 times" not in bench.sonarctl("stats").stdout, bench.sonarctl("stats").stdout)


cases = [("answers_" + f.__name__, f) for f in (nearest, limit, drift, old_place, explain, unknown_ahead, collision, stats, ray,
                                                doubted, radians, unmeasured)]
run(cases, parallel=4, gate=("answers_radians", "answers_unmeasured"))
