#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Answers of a running daemon, its counters and latencies. tests/voyage/test_answers.py asks about moving."""
import json
import math
import re
import socket
import threading

from lib import SONARD, check, pings_until, refused, run, until
from made_capture import MadeCapture

TURN = 200  # pings of a full circle at 1.8 degrees


def basin(bench, **vehicle):
    bench.sim()
    bench.conf(vehicle=vehicle, pose={"max_age": "60 s"})
    client = bench.sonard().client()
    pings_until(client, TURN + 20)
    return client


def poses(bench):
    """What a client tells of the pose is in the next answer; what it asks may be watched."""
    client = basin(bench, unknown="ignore")
    refused(client, "time_to_collision", -32600)
    client.call("pose", velocity_mps=[0, 0, 0], attitude_deg=[0, 0, 0])
    check(client.call("time_to_collision")["reason"] == "the vehicle is at rest", "at rest")
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

    def told():
        client.call("pose", attitude_deg=[0, 0, 0], depth_m=-5)  # one that waited for a stalled daemon is not taken
        return "depth_m = -5 is above the surface" in daemon.log()
    until(told, "the warning")


def radians(bench):
    """An attitude that turns around in radians is taken, and told; one in degrees, and one that points north, is not."""
    conf = bench.conf()
    for name, heading, told in (("radians", lambda t: math.remainder(t / 10, math.tau), True), ("degrees", lambda t: 178 + t, False),
                                ("north", lambda t: 0, False)):
        made = MadeCapture(bench.path(name), ("/pose", "json"))
        for second in range(70):
            pose = {"t_unix": 1.7e9 + second, "attitude_deg": [0.05, -0.1, heading(second)] if name != "north" else [0, 0, 0]}
            made.write([(1, (1700000000 + second) * 10**9, json.dumps(pose).encode())])
        made.end()
        said = bench.run(SONARD, "--replay", bench.path(name), "-c", conf, "--socket", "none").stderr
        check(("as one in radians does: send degrees" in said) == told, "%s: %s" % (name, said))


def unmeasured(bench):
    """A replay measures no latency, and says nothing of it rather than 0."""
    daemon = bench.sonard("--replay", "tests/replay/box.mcap", "--stay", "--socket", bench.socket_path, conf=False)
    client = daemon.client()
    until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay")
    check(client.call("status")["pipeline"]["latency_us"] is None, client.call("status")["pipeline"])
    said = bench.sonarctl("status").stdout
    check("0 pings dropped\n" in said, said)
    check(re.search(r"\n +detection threshold -\d+\.\d dB \(\d+ counts\) for a wall, measured on this sonar\n", said), said)
    check("no pose received: the vehicle is assumed to stand still" in said and "keep sending" not in said, said)
    judged = bench.sonarctl("sectors", "--distance", "1.5").stdout.splitlines()[0]
    check("azimuth clockwise from forward, judged to 1.50 m, no pose" in judged, judged)
    check(" 0 times" not in bench.sonarctl("stats").stdout, bench.sonarctl("stats").stdout)


def says(listener, states):
    """A daemon for one client after the other, each of which asks once and is told the next state."""
    for state in states:
        made = listener.accept()[0]
        with made, made.makefile("rw", encoding="utf-8") as lines:
            asked = json.loads(lines.readline())
            lines.write(json.dumps({"jsonrpc": "2.0", "id": asked["id"], "result": {"state": state}}) + "\n")
            lines.flush()
            lines.read()  # until it has left


def exit_status(bench):
    """A script that goes on `sonarctl blocked ... && go` goes where it is clear alone; what nobody knows is not."""
    direction, way = ("blocked", "0", "--distance", "3"), ("path", "0,0,2", "3,0,2", "--radius", "0.5")
    rows = [(direction, "clear", 0), (direction, "blocked", 1), (direction, "unknown", 2), (direction, "nonsense", 2)]
    for command in (way, ("point", "0,0,2"), ("box", "0,0,2", "1,1,3")):
        rows += [(command, "free", 0), (command, "occupied", 1), (command, "unknown", 2), (command, "clear", 2)]
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(bench.socket_path)
        listener.listen()
        daemon = threading.Thread(target=says, args=(listener, [state for _, state, _ in rows]), daemon=True)
        daemon.start()
        for command, state, status in rows:
            out = bench.sonarctl("--timeout", "600", *command)
            check(out.returncode == status, "%s, %s: %d %s" % (command, state, out.returncode, out.stderr))
        daemon.join(60)
        check(not daemon.is_alive(), "it asks less often than it is called")


cases = [("answers_" + f.__name__, f) for f in (poses, stats, ray, doubted, radians, unmeasured, exit_status)]
run(cases, parallel=4, gate=("answers_ray", "answers_radians", "answers_unmeasured", "answers_exit_status"))
