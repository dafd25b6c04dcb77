#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The voxel map: a virtual basin against its truth, files, exports, threads, and what is refused."""
import glob
import hashlib
import json
import math
import os
import random
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time

from lib import BUILD, SANITIZER, Failed, RpcError, Skipped, check, note, pings_until, run, until

TURN = 200                             # pings of a full circle at 1.8 degrees
WALLS = ((-6.0, 9.0), (-5.0, 4.0))     # of the virtual basin: north, east
VOXEL = 0.2
LAG_M = 0.05                           # what the vehicle drives between a ping and the pose that is said of it


class Vehicle(threading.Thread):
    """Says fifty times a second where it is, and goes there with the virtual sonar."""

    def __init__(self, daemon, sim, step_m=0.02):
        super().__init__(daemon=True)
        self.client = daemon.client()
        self.step_m = step_m
        self.sim = sim
        self.at = [0.0, 0.0, 2.0]
        self.goal = list(self.at)
        self.ended = threading.Event()

    def run(self):
        while not self.ended.wait(0.02):
            step = [max(-self.step_m, min(self.step_m, g - a)) for g, a in zip(self.goal, self.at)]
            self.at = [a + s for a, s in zip(self.at, step)]
            if any(step):
                self.sim.command("pose %.3f %.3f %.3f 0" % tuple(self.at))
            self.client.call("pose", attitude_deg=[0, 0, 0], position_m=self.at)

    def go(self, north, east):
        self.goal = [north, east, 2.0]
        until(lambda: max(abs(g - a) for g, a in zip(self.goal, self.at)) < 0.01, "the vehicle to arrive", 60)

    def stop(self):
        self.ended.set()
        self.join()
        self.client.close()


def conf(bench, threads=0, vehicle=None, **keys):
    section = {"voxel": "%g m" % VOXEL, "opening": 1, "memory": "48 MiB", "directory": bench.folder}
    section.update(keys)
    bench.conf(map=section, pipeline={"threads": threads}, vehicle=vehicle or {})


def dive(bench, daemon, sim):
    """Two places, a turn and a half at each."""
    client = daemon.client()
    vehicle = Vehicle(daemon, sim)
    vehicle.start()
    try:
        pings_until(client, 3 * TURN, 60)
        client.call("map_new")
        vehicle.go(2.0, -1.0)
        check(client.call("map")["begun"] == 2, "no second submap")
        pings_until(client, 3 * TURN, 60)
    finally:
        vehicle.stop()
    return client


def clearance(place):
    return min(min(p - low, high - p) for p, (low, high) in zip(place, WALLS))


def state_of(client, method, **params):
    return client.call(method, **params)["state"]


def job(client, method, **params):
    client.call(method, **params)
    return until(lambda: (lambda j: j if j["state"] != "running" else None)(client.call("map")["job"]), "the job", 60)


def done(client, method, **params):
    result = job(client, method, **params)
    check(result["state"] == "done", "%s: %s" % (method, result))
    return result["path"]


def check_points(client, dice, least=300):
    """No place behind a wall is free; most of the basin is."""
    found = 0
    for _ in range(1500):
        place = [dice.uniform(-8, 11), dice.uniform(-7, 6), dice.uniform(1, 3)]
        answer = client.call("point", position_m=place)
        inside = clearance(place)
        check(answer["state"] != "free" or inside > -VOXEL / 2 - LAG_M, "free behind a wall: %s" % place)
        found += answer["state"] == "free" and inside > 0
        if answer["state"] == "free":
            check(answer["age_s"] is not None, str(answer))
    check(found > least, "only %d places of the basin are free" % found)
    return found


def check_paths(client, dice):
    free = 0
    for _ in range(400):
        way = [[dice.uniform(-6, 9), dice.uniform(-5, 4), 2.0] for _ in range(dice.randint(1, 4))]
        radius = dice.uniform(0, 0.8)
        answer = client.call("path", points_m=way, radius_m=radius)
        least = min(clearance(p) for p in way)
        if answer["state"] == "free":
            free += 1
            check(answer["first"] is None and least > radius - VOXEL / 2 - LAG_M, "%s %g: %s" % (way, radius, answer))
        else:
            check(answer["first"]["along_m"] >= 0 and 0 <= answer["unknown_share"] <= 1, str(answer))
            farther = answer["state"] == "occupied" and answer["first"]["state"] == "unknown"
            check(("farther on" in answer["reason"]) == farther, "the reason is of another place: %s" % answer)
        wider = client.call("path", points_m=way, radius_m=radius + 0.3)
        check(not (wider["state"] == "free" and answer["state"] != "free"), "wider is freer: %s" % way)
    check(free >= 5, "only %d paths are free" % free)
    return free


def basin(bench, threads):
    """Answers about places against what is there, in steps that threads must not change."""
    sim = bench.sim()
    conf(bench, threads)
    client = dive(bench, bench.sonard(), sim)
    dice = random.Random(7)
    free = check_points(client, dice)
    paths = check_paths(client, dice)
    status = client.call("map")
    check(status["state"] == "kept" and status["pings"] > 4 * TURN and status["starved"] == 0, str(status))
    note("%d threads: %d of 1500 points and %d of 400 paths free, none behind a wall" % (threads, free, paths))
    wall = client.call("path", points_m=[[3, 1, 2], [14, 1, 2]], radius_m=0.2)
    check(wall["state"] == "occupied" and 4.5 < wall["first"]["along_m"] < 6, "to the wall: %s" % wall)
    check(state_of(client, "box", from_m=[3, 0, 1.8], to_m=[5, 1, 2.2]) == "free", "a box in the water")
    check(state_of(client, "box", from_m=[3, 0, 1.8], to_m=[12, 1, 2.2]) == "occupied", "a box through a wall")

    check_large(client)
    check_examples(client)
    drawn = bench.sonarctl("map", "draw", "--depth", "2", "--middle", "1.5,-0.5", "--size", "20")
    check(drawn.returncode == 0 and drawn.stdout.count(".") > 500 and "#" in drawn.stdout, drawn.stdout + drawn.stderr)
    svg = bench.sonarctl("map", "draw", "--depth", "2", "--middle", "1.5,-0.5", "--size", "20", "-o", "-")
    check(svg.stdout.rstrip().endswith("</svg>") and svg.stdout.count("<rect") > 50, svg.stderr)
    for words, wanted in ((("point", "1,0.5,2"), 0), (("point", "30,0,2"), 2),
                          (("path", "3,1,2", "6,1,2", "--radius", "0.2"), 0),
                          (("path", "3,1,2", "30,1,2", "--radius", "0.2"), 1),
                          (("box", "3,0,2", "4,1,2"), 0), (("point", "1,2"), 3)):
        result = bench.sonarctl(*words)
        check(result.returncode == wanted, "%s: %d, %s" % (words, result.returncode, result.stdout + result.stderr))


def jumps(bench):
    """A pose that the vehicle cannot have come to holds the map, until it jumps back or somebody says what is true."""
    sim = bench.sim()
    conf(bench, vehicle={"max_speed": "1 m/s"})
    daemon = bench.sonard()
    client = dive(bench, daemon, sim)
    water = {"from_m": [3, 0, 1.8], "to_m": [4, 1, 2.2]}

    def give(north_m):
        client.call("pose", position_m=[north_m, 0, 2], attitude_deg=[0, 0, 0])

    def held():
        answer = client.call("box", **water)
        status = client.call("map")["state"]
        check((answer["state"] != "free") == status.startswith("held"), "%s, %s" % (answer, status))
        check(answer["state"] == "free" or "jumped" in answer["reason"], str(answer))
        return answer["state"] != "free"

    def held_now():
        return client.call("map")["state"].startswith("held")

    give(2)
    check(not held(), "held where the vehicle is")
    give(90)
    check(held(), "not held after a jump")
    give(91)
    check(held(), "two positions of another origin are taken for a way")
    give(2.5)
    check(not held(), "held, and the position is back")
    client.call("pose", depth_m=12)
    check(held(), "a depth of another datum is taken for a dive")
    client.call("pose", depth_m=2)
    check(not held(), "held, and the depth is back")
    give(-400)
    check(held() and client.call("map_new") and not held(), "held, and the client says that it is the same place")
    give(-401)
    give(50)
    check(held() and client.call("map_forget")["state"] != "held", "a second jump")
    give(51)
    check("held" not in client.call("map")["state"], "held, and nothing is in it")
    check("the pose jumped by" in daemon.log(), daemon.log())
    for vehicle, found in (({}, False), ({"max_speed": "1 m/s"}, True)):
        client.close()
        daemon.stop()
        conf(bench, vehicle=vehicle)
        daemon = bench.sonard()
        client = daemon.client()
        give(2)
        until(lambda: give(2) or client.call("map")["pings"] > 0, "a ping in the map")
        time.sleep(1.2)
        give(16)
        check(held_now() == found, "14 m in 1.2 s by a vehicle of %s" % (vehicle or "any speed"))


def requests_and_parts(client):
    stage = {"stage": "request"}
    return next(s["count"] for m in client.call("stats")["metrics"] for s in m["samples"] if s.get("labels") == stage)


def check_large(client):
    """A question about two million voxels is answered in parts, between which pings and others have their turn."""
    before = requests_and_parts(client)
    box = dict(from_m=[-12, -12, -10], to_m=[12.4, 12.4, 14.4])
    check(state_of(client, "box", **box) == "occupied", "a large box with walls in it")
    parts = requests_and_parts(client) - before
    check(parts > 100, "a question about 1.8 million voxels was answered in %d parts" % parts)
    watch = client.call("watch", method="box", params=box, rate_hz=20)["watch"]
    until(lambda: client.call("version") and client.notifications, "a large box that is watched")
    check(client.notifications[0]["result"]["state"] == "occupied", str(client.notifications[0]))
    client.call("unwatch", watch=watch)


def check_examples(client):
    """What the manual page shows is answered as it says."""
    with open(os.path.join(BUILD, "sonard-protocol.7"), encoding="utf-8") as f:
        lines = [line for line in f if line.startswith('{"jsonrpc"') and ('"position_m"' in line or '"from_m"' in line
                 or '"points_m"' in line or '"map_' in line)]
    check(len(lines) == 5, "%d examples" % len(lines))
    for line in lines:
        client.send(line.encode())
        reply = client.reply()
        check("result" in reply and reply["id"] == json.loads(line)["id"], "%s: %s" % (line, reply))
        if "state" in reply["result"] and "reason" in reply["result"]:
            check(reply["result"]["state"] == "free", "%s: %s" % (line, reply))


def slices(client):
    return [client.call("map_slice", depth_m=depth, middle_m=[1.5, -0.5], size_m=24)["rows"] for depth in (1, 2, 3)]


def files(bench):
    """Saved, cleared, loaded, also by another daemon: the same answers."""
    sim = bench.sim()
    conf(bench)
    daemon = bench.sonard()
    client = dive(bench, daemon, sim)
    sim.command("silent 1000")
    time.sleep(0.5)
    before = slices(client)
    saved = bench.sonarctl("map", "save", "basin")
    check(saved.returncode == 0 and "saved as" in saved.stdout, saved.stdout + saved.stderr)
    path = bench.path("basin.map")
    check(os.path.exists(path) and not os.path.exists(path + ".new"), "not saved")
    client.call("map_forget")
    check(state_of(client, "point", position_m=[1, 0, 2]) == "unknown", "cleared, and not unknown")
    check(not any("." in row for rows in slices(client) for row in rows), "something is left")
    done(client, "map_load", name="basin")
    check(slices(client) == before, "what was loaded is not what was saved")
    daemon.stop()
    client = bench.sonard().client()
    loaded = bench.sonarctl("map", "load", "basin")
    check(loaded.returncode == 0 and "another run" in loaded.stdout, loaded.stdout + loaded.stderr)
    check(slices(client) == before, "another daemon has another map")
    check_load_at_start(bench, before)
    client = bench.sonard().client()
    done(client, "map_load", name="basin")
    check_foreign(bench, client, path, before)


def check_load_at_start(bench, before):
    """load in [map]: a named map is there from the start; one that is not is told, and the run begins empty."""
    for name, loaded in (("basin", True), ("nowhere", False)):
        bench.processes[-1].stop()
        conf(bench, load=name)
        daemon = bench.sonard()
        client = daemon.client()
        kept = client.call("map")["kept"]
        check((slices(client) == before) == loaded, "load = %s: %s" % (name, kept))
        check((kept["what"], kept["state"]) == ("load", "done" if loaded else "failed"), str(kept))
        check(loaded or "no such map; there are: basin" in daemon.log(), daemon.log())
        client.close()
    bench.processes[-1].stop()
    conf(bench)


def veil(bench):
    """What was heard beyond a submap's box is known of in a saved map, too."""
    sim = bench.sim()
    conf(bench, height="2 m")
    client = bench.sonard().client()
    vehicle = Vehicle(bench.processes[-1], sim)
    vehicle.start()
    try:
        pings_until(client, 2 * TURN)
    finally:
        vehicle.stop()
    sim.command("silent 1000")
    time.sleep(0.5)

    def heard():
        return "was forgotten" in client.call("point", position_m=[-6, 0, 3.6])["reason"]
    check(heard(), "the wall below the box: %s" % client.call("point", position_m=[-6, 0, 3.6]))
    done(client, "map_save", name="veiled")
    client.call("map_forget")
    check(not heard(), "it is not forgotten")
    done(client, "map_load", name="veiled")
    check(heard(), "not saved")


def surface_of(client, **params):
    """All pages of one reading: points by place, and whether the map changed meanwhile."""
    points, cursor, changed, pages = {}, None, False, 0
    while cursor is not None or not pages:
        page = client.call("surface", cursor=cursor, **params)
        for p in page["points"]:
            place = tuple(p["position_m"])
            check(place not in points, "told twice: %s" % p)
            points[place] = p
        cursor, changed, pages = page["cursor"], changed or page["changed"], pages + 1
    return points, changed, pages


def surface(bench):
    """The same points in any pages as in the export, tagged alike; a cursor of nobody is refused."""
    sim = bench.sim()
    conf(bench)
    daemon = bench.sonard()
    client = dive(bench, daemon, sim)
    sim.command("silent 1000")
    time.sleep(0.5)
    points, changed, pages = surface_of(client, count=50)
    again, _, fewer = surface_of(client, count=1024)
    check(points == again and pages > fewer, "%d pages and %d tell different points" % (pages, fewer))
    check(not changed, "nothing has happened, and changed is said")
    with open(done(client, "map_export", name="surface", format="ply"), "rb") as f:
        head, data = f.read().split(b"end_header\n", 1)
    check(len(points) == len(data) // 40 > 1000, "%d points, exported %d" % (len(points), len(data) // 40))
    heard = sum(p["tag"] == "echo" for p in points.values())
    check(heard == sum(data[36::40]) > 100, "%d of them heard" % heard)
    for cursor in ("", "1", "1.2.3.4.5", "a.b.c.d", "1.-2.3.4", 7, "9" * 60):
        expect_refusal(client, "surface", {"cursor": cursor}, "cursor", -32602)
    far = client.call("surface", cursor="4294967295.999999999999999999.1.1")
    check(far["points"] == [] and far["cursor"] is None and far["changed"], "behind the end: %s" % far)
    page = client.call("surface", count=1)
    client.call("map_move", id=1, position_m=[0, 0, 2])
    check(client.call("surface", cursor=page["cursor"])["changed"], "a submap was moved, and nothing is said")
    note("%d points, %d of them heard, in %d pages" % (len(points), heard, pages))


def moves(bench):
    """A submap that lies elsewhere than was thought: its water goes with it, into files and back."""
    sim = bench.sim()
    conf(bench)
    daemon = bench.sonard()
    client = dive(bench, daemon, sim)
    sim.command("silent 1000")
    time.sleep(0.5)
    first, second = client.call("map_submaps")["submaps"]
    check((first["current"], second["current"]) == (False, True), "the second is the current one: %s" % second)
    client.call("map_new")
    north, east, down = first["position_m"]
    moved = client.call("map_move", id=first["id"], position_m=[north + 100, east, down], attitude_deg=[0, 0, 90])
    check(moved["moved"] and abs(moved["quaternion"][3] - math.sin(math.pi / 4)) < 1e-6, "not turned: %s" % moved)
    # what was 7 m ahead of its base is now 7 m to the east of the new one
    def place(ahead):
        return state_of(client, "point", position_m=[north + 100, east + ahead, down])
    check(place(7) == "free" and place(12) != "free", "it did not go there")
    done(client, "map_save", name="moved")
    done(client, "map_load", name="moved")
    check(place(7) == "free" and client.call("map_submaps")["submaps"][0]["moved"], "not saved as it lies")
    expect_refusal(client, "map_move", {"id": 999, "position_m": [0, 0, 0]}, "no such submap", -32602)
    expect_refusal(client, "map_move", {"id": 1}, "position_m", -32602)
    expect_refusal(client, "map_move", {"id": 0, "position_m": [0, 0, 0]}, "id", -32602)


def loop_closure(bench):
    """The example moves and turns each submap as the pose of its start was."""
    sim = bench.sim()
    conf(bench)
    client = dive(bench, bench.sonard(), sim)
    sim.command("silent 1000")
    time.sleep(0.5)
    first, second = client.call("map_submaps")["submaps"]
    now, (north, east, down) = time.time(), first["position_m"]
    with open(bench.path("closed.csv"), "w", encoding="utf-8") as f:
        f.write("t_unix,north_m,east_m,down_m,yaw_deg,to_north_m,to_east_m,to_down_m,to_yaw_deg\n")
        f.write("%f,%f,%f,%f,10," % (now - first["begin_age_s"], north - 1, east, down))
        f.write("%f,%f,%f,100\n" % (north + 50, east, down))
        f.write("%f,0,0,0,0,0,0,0.5,0\n" % (now - second["begin_age_s"]))
    run_example = [sys.executable, "-B", "examples/loop_closure.py", bench.socket_path, bench.path("closed.csv")]
    told = subprocess.run(run_example, text=True, capture_output=True, check=False, timeout=60,
                          env=dict(os.environ, PYTHONPATH="python"))
    check(told.returncode == 0, told.stderr)
    after = {s["id"]: s for s in client.call("map_submaps")["submaps"]}
    # its base was 1 m ahead of the pose, to the north; turned by 90 degrees that is to the east
    base, turn = after[first["id"]]["position_m"], after[first["id"]]["quaternion"]
    check(math.dist(base, (north + 50, east + 1, down)) < 1e-3, "the first is at %s" % base)
    check(math.dist(turn, (math.sqrt(0.5), 0, 0, math.sqrt(0.5))) < 1e-6, "the first is turned by %s" % turn)
    sank = [a - b for a, b in zip(after[second["id"]]["position_m"], second["position_m"])]
    check(math.dist(sank, (0, 0, 0.5)) < 1e-3, "the second moved by %s" % sank)
    told = subprocess.run(run_example, text=True, capture_output=True, check=False, timeout=60,
                          env=dict(os.environ, PYTHONPATH="python"))
    turn = {s["id"]: s for s in client.call("map_submaps")["submaps"]}[first["id"]]["quaternion"]
    check(told.returncode == 0 and abs(abs(turn[3]) - 1) < 1e-6, "turned by 90 degrees twice: %s" % turn)


def origins(bench):
    """A map whose places count from elsewhere, or from nobody knows where, is not loaded."""
    bench.sim()
    saved = {}
    for name in ("none", "basin-east", "geo:41.1784,-8.6071"):
        conf(bench, origin=name)
        daemon = bench.sonard()
        client = daemon.client()
        saved[name] = "m%d" % len(saved)
        done(client, "map_save", name=saved[name])
        for other, file in saved.items():
            result = job(client, "map_load", name=file)
            check((result["state"] == "done") == (other == name), "%s in %s: %s" % (other, name, result))
            check(other == name or "count from" in result["message"] and "origin in [map]" in result["message"],
                  str(result))
            check("another run" not in result["message"], "of this very run: %s" % result)
        client.close()
        daemon.stop()


def check_foreign(bench, client, path, before):
    """Files that are none, or none of ours, or damaged: refused, and the map stays as it is."""
    with open(path, "rb") as f:
        good = f.read()

    def refused(name, content, why, aside):
        bench.write(name + ".map", content)
        result = job(client, "map_load", name=name)
        check(result["state"] == "failed" and why in result["message"], "%s: %s" % (name, result))
        check(os.path.exists(bench.path(name + ".map.damaged")) == aside, "%s: set aside or not" % name)
        check(slices(client) == before, name + " has changed the map")

    flipped = bytearray(good)
    flipped[len(good) // 2] ^= 4
    refused("flipped", bytes(flipped), "damaged", True)
    refused("short", good[:-1000], "damaged", True)
    refused("empty", b"", "not a map", False)
    refused("other", b"ply\nformat ascii 1.0\n", "not a map", False)
    refused("newer", good[:8] + struct.pack("<I", 4) + good[12:], "version 4", False)
    missing = bench.sonarctl("map", "load", "nowhere")
    check(missing.returncode == 6 and "no such map" in missing.stderr, missing.stderr)
    bench.write("mine.map", "my own notes")
    result = job(client, "map_save", name="mine")
    check(result["state"] == "failed" and "not replaced" in result["message"], str(result))
    conf(bench, voxel="0.25 m")
    client.close()
    bench.processes[-1].stop()
    client = bench.sonard().client()
    result = job(client, "map_load", name="basin")
    check(result["state"] == "failed" and "0.25" in result["message"] and os.path.exists(path), str(result))


def replay(bench):
    """A capture with 0, 1 and 2 threads: the same bytes."""
    sim = bench.sim()
    conf(bench)
    captures = bench.path("captures")
    os.mkdir(captures)
    daemon = bench.sonard("--record", captures)
    dive(bench, daemon, sim)
    daemon.stop()
    (capture,) = glob.glob(os.path.join(captures, "*.mcap"))
    sums = set()
    for threads in ("0", "1", "2", "0"):
        daemon = bench.sonard("--replay", capture, "--stay", "--threads", threads, conf=False)
        client = daemon.client()
        until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay", 60)
        pings = client.call("map")["pings"]
        check(pings > 4 * TURN, "%d pings" % pings)
        done(client, "map_save", name="replayed")
        with open(bench.path("replayed.map"), "rb") as f:
            sums.add(hashlib.sha256(f.read()).hexdigest())
        daemon.stop()
    check(len(sums) == 1, "maps differ: %s" % sums)
    note("the map of %d pings has sha256 %s with 0, 1 and 2 threads" % (pings, sums.pop()))


SMALL = {"memory": "8 MiB", "height": "6 m", "submap_distance": "1 m"}


def saving(bench):
    """More submaps than memory: the oldest are saved once and dropped, one may be loaded again; a folder that is gone is told."""
    sim = bench.sim()
    maps, captures = bench.path("maps"), bench.path("captures")
    os.mkdir(maps)
    os.mkdir(captures)
    conf(bench, directory=maps, **SMALL)
    daemon = bench.sonard("--record", captures)
    client = daemon.client()
    vehicle = Vehicle(daemon, sim)
    vehicle.start()
    try:
        for north in (4, -2, 4, -2, 4):
            vehicle.go(north, 0)
        until(lambda: client.call("map")["saved"] >= 3, "submaps to be saved", 60)
    finally:
        vehicle.stop()
    status = client.call("map")
    check(status["starved"] == 0 and status["save_errors"] == 0 and status["dropped"] - status["saved"] in (0, -1), str(status))
    check(status["used_bytes"] < status["memory_bytes"], str(status))
    note("%(begun)d submaps begun, %(saved)d saved, %(submaps)d left" % status)
    dice = random.Random(5)
    check_points(client, dice, 100)  # how much a vehicle under way has seen depends on the machine
    before = client.call("map")["submaps"]
    with open(done(client, "map_save", name="rest"), "rb") as f:
        count = struct.unpack("<I", f.read(16)[12:])[0]
    after = client.call("map")["submaps"]  # pings go on, and the oldest may be dropped meanwhile
    check(min(before, after) <= count <= max(before, after), "%d submaps saved of %d, then %d" % (count, before, after))
    done(client, "map_export", name="rest")
    check_refused(client, "map_save", "dropped-1")
    done(client, "map_load", name="dropped-1")
    brought = client.call("map_submaps")["submaps"][0]
    check(brought["pings"] > 50 and brought["begin_age_s"] is None, brought)
    daemon.stop()
    check(len(glob.glob(os.path.join(maps, "dropped-*.map"))) >= 3, os.listdir(maps))
    check_folder_gone(bench, sim, maps)
    replay_all(bench, captures, maps)


def check_refused(client, method, name):
    try:
        client.call(method, name=name)
        check(False, "%s took the name %s" % (method, name))
    except RpcError as why:
        check("take another" in str(why), why)


def one_folder(bench):
    """A second daemon in the same folder does not start."""
    bench.sim()
    maps = bench.path("maps")
    os.mkdir(maps)
    conf(bench, directory=maps)
    daemon = bench.sonard()
    daemon.client().close()
    other = bench.conf(name="second.conf", map={"voxel": "1 m", "directory": maps},
                       server={"socket": bench.path("second.sock")})
    second = bench.sonard(conf=other)
    second.expected = 1
    check(second.wait() == 1 and "another sonard uses the folder" in second.log(), second.log())
    daemon.stop()
    bench.sonard().client().close()


def check_folder_gone(bench, sim, maps):
    """Nowhere to put submaps: the oldest are forgotten, counted, and nothing else happens."""
    daemon = bench.sonard()
    client = daemon.client()
    shutil.rmtree(maps)
    vehicle = Vehicle(daemon, sim)
    vehicle.start()
    try:
        for north in (4, -2, 4, -2):
            vehicle.go(north, 0)
        until(lambda: client.call("map")["save_errors"] > 2, "the fault", 30)
    finally:
        vehicle.stop()
    status = client.call("map")
    check(status["saved"] == 0 and "cannot be saved" in daemon.log(), str(status))
    check(client.call("map")["pings"] > 0, "no pings")
    daemon.stop()
    os.mkdir(maps)


def replay_all(bench, captures, maps):
    (capture,) = glob.glob(os.path.join(captures, "*.mcap"))
    sums, out = set(), 0
    for threads in ("0", "1", "2"):
        daemon = bench.sonard("--replay", capture, "--stay", "--threads", threads, conf=False)
        client = daemon.client()
        until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay", 60)
        out, saved = client.call("map")["dropped"], client.call("map")["saved"]
        with open(done(client, "map_save", name="replayed"), "rb") as f:
            sums.add(hashlib.sha256(f.read()).hexdigest())
        daemon.stop()
    check(len(sums) == 1 and out > 0 and saved == 0, "maps differ: %s, %d dropped, %d saved" % (sums, out, saved))


def killed(bench):
    """Killed while it saves: the old map or the new one, never half of one."""
    sim = bench.sim()
    conf(bench)
    daemon = bench.sonard()
    client = dive(bench, daemon, sim)
    done(client, "map_save", name="whole")
    path = bench.path("whole.map")
    size = os.path.getsize(path)
    shutil.copy(path, bench.path("start.map"))
    dice = random.Random(11)
    for _ in range(12):
        client.call("map_save", name="whole")
        time.sleep(dice.uniform(0, 0.02))
        daemon.expected = -signal.SIGKILL
        daemon.process.kill()
        daemon.wait()
        client.close()
        daemon = bench.sonard()
        client = daemon.client()
        result = job(client, "map_load", name="whole")
        check(result["state"] == "done", str(result))
    note("killed 12 times while %d bytes were saved: whole each time" % size)


def exports(bench):
    """The surface and the volume in the formats of others."""
    sim = bench.sim()
    conf(bench)
    client = dive(bench, bench.sonard(), sim)
    sim.command("silent 1000")
    time.sleep(0.5)
    with open(done(client, "map_export", name="surface"), "rb") as f:
        head, body = f.read().split(b"end_header\n", 1)
    count = int(head.split(b"element vertex ")[1].split()[0])
    check(len(body) == 40 * count and count > 1000, "%d bytes of %d points" % (len(body), count))
    heard = 0
    for east, north, up, nx, ny, nz, tag in struct.iter_unpack("<3d3fB3x", body):
        check(clearance((north, east)) > -VOXEL / 2 - LAG_M, "a point behind a wall: %g %g %g" % (north, east, up))
        length = math.hypot(nx, ny, nz)
        check(abs(length - 1) < 1e-5 or length == 0, "a normal of length %g" % length)
        heard += tag
    check(0 < heard < count, "%d of %d points are of echoes" % (heard, count))
    done(client, "map_save", name="one")
    slip = bench.sonarctl("map", "load", "on")
    check(slip.returncode != 0 and "no such map; there are: one" in slip.stderr, slip.stderr)
    mcap = done(client, "map_export", name="surface", format="mcap")
    told = bench.sonarctl("capture", "info", mcap)
    check(told.returncode == 0 and "/map/surface" in told.stdout, told.stdout + told.stderr)
    read = subprocess.run(["tests/mcap/check.sh", mcap], text=True, capture_output=True, check=False, timeout=300)
    check(read.returncode == 0 and ("%d points" % count in read.stdout or read.stdout.startswith("skip")),
          read.stdout + read.stderr)
    note(read.stdout.strip())
    tree = done(client, "map_export", name="tree", format="bt")
    note("%d points, %d of them heard; %d bytes of tree" % (count, heard, os.path.getsize(tree)))
    check_octomap(bench, client, tree)


READER = """
#include <octomap/octomap.h>
#include <cstdio>
int main(int, char **v)
{
    octomap::OcTree tree{std::string(v[1])};
    double n, e, d;
    std::printf("%zu %g\\n", tree.size(), tree.getResolution());
    while (std::scanf("%lf %lf %lf", &n, &e, &d) == 3) {
        octomap::OcTreeNode *node = tree.search(e, n, -d);
        std::puts(!node ? "unknown" : tree.isNodeOccupied(node) ? "occupied" : "free");
    }
}
"""


def check_octomap(bench, client, tree):
    """OctoMap itself says of every place what the daemon says."""
    compiler = shutil.which("g++")
    if not compiler or not os.path.exists("/usr/include/octomap/octomap.h"):
        note("skip octomap: needs g++ and liboctomap-dev")
        return
    built = subprocess.run([compiler, "-x", "c++", "-std=c++17", "-O1", "-w", "-", "-o", bench.path("reader"),
                            "-loctomap", "-loctomath"], input=READER, text=True, capture_output=True, check=False)
    check(built.returncode == 0, built.stderr[-500:])
    dice = random.Random(3)
    places = [[dice.uniform(-9, 12), dice.uniform(-8, 7), dice.uniform(-3, 6)] for _ in range(3000)]
    read = subprocess.run([bench.path("reader"), tree], input="".join("%.9g %.9g %.9g\n" % tuple(p) for p in places),
                          text=True, capture_output=True, check=False, timeout=60)
    lines = read.stdout.split("\n")
    with open(tree, "rb") as f:
        size = int(f.read(200).split(b"size ")[1].split()[0])
    check("ERROR" not in read.stderr and lines[0] == "%d %g" % (size, VOXEL), "%s %s" % (lines[0], read.stderr))
    said = [state_of(client, "point", position_m=place) for place in places]
    wrong = [(p, a, b) for p, a, b in zip(map_service, said, lines[1:]) if a != b]
    check(not wrong, "%d places differ, the first %s" % (len(wrong), wrong[:1]))
    note("OctoMap reads %d nodes; %d places, %d of them free, are the same" % (size, len(map_service), said.count("free")))


def expect_refusal(client, method, params, why, code=None):
    try:
        client.call(method, **params)
    except RpcError as refusal:
        check(why in str(refusal), "%s: %s" % (method, refusal))
        check(code is None or refusal.code == code, "%s: code %d: %s" % (method, refusal.code, refusal))
        return
    raise Failed("%s %s is not refused" % (method, params))


def refusals(bench):
    """What cannot be asked or done says why."""
    bench.sim()
    bench.conf()
    daemon = bench.sonard()
    client = daemon.client()
    check(client.call("map")["state"].startswith("none"), str(client.call("map")))
    expect_refusal(client, "point", {"position_m": [0, 0, 0]}, "set voxel in [map]")
    expect_refusal(client, "map_save", {"name": "x"}, "set voxel in [map]")
    told = bench.sonarctl("map", "status")
    check(told.returncode == 0 and "none" in told.stdout, told.stdout + told.stderr)
    daemon.stop()
    conf(bench, directory="none")
    daemon = bench.sonard()
    client = daemon.client()
    for method, params, why in (
            ("point", {}, "position_m"), ("point", {"position_m": [1, 2]}, "3 numbers"),
            ("point", {"position_m": [1, 2, 3], "frame": "body"}, "fresh pose"),
            ("point", {"position_m": [1, 2, 3], "radius": 1}, "radius"),
            ("box", {"from_m": [0, 0, 0]}, "to_m"), ("box", {"from_m": [0, 0, 0], "to_m": [90, 90, 90]}, "voxels"),
            ("path", {"points_m": [[0, 0, 0]]}, "radius_m"), ("path", {"points_m": [], "radius_m": 1}, "1 to 256"),
            ("path", {"points_m": [[0, 0, "x"]], "radius_m": 1}, "number"),
            ("path", {"points_m": [[0, 0, 0], [9e4, 0, 0]], "radius_m": 9}, "voxels"),
            ("map_slice", {"size_m": 9999, "cells": 4}, "too large"), ("map_save", {"name": "x"}, "no folder"),
            ("map_export", {"name": "x", "format": "pdf"}, "format"), ("map_load", {}, "name")):
        expect_refusal(client, method, params, why)
    check(state_of(client, "point", position_m=[0, 0, 0]) == "unknown", "nothing pinged, and not unknown")
    reason = client.call("path", points_m=[[0, 0, 0], [1, 0, 0]], radius_m=0.2)["reason"]
    check("set body in [map]" in reason, reason)
    drawn = bench.sonarctl("map", "draw")
    check(drawn.returncode == 0 and "nothing is known" in drawn.stderr, drawn.stderr)
    check(state_of(client, "path", points_m=[[0, 0, 0]], radius_m=0) == "unknown", "nothing pinged, and not unknown")
    daemon.stop()
    conf(bench)
    client = bench.sonard().client()
    for name in ("", "../x", "a/b", ".hidden", "x" * 65, "a b"):
        for method in ("map_save", "map_load", "map_export"):
            expect_refusal(client, method, {"name": name}, "want a file name", -32602)
    bad = bench.path("bad.conf")
    with open(bench.path("sonard.conf"), encoding="ascii") as f:
        text = f.read()
    with open(bad, "w", encoding="ascii") as f:
        f.write(text.replace("voxel = 0.2 m", "voxel = 9 m"))
    faults = bench.run(os.path.join(os.environ.get("BUILD", "build"), "sonard"), "--check", bad)
    check(faults.returncode == 1 and "voxel" in faults.stderr and "bad.conf:" in faults.stderr, faults.stderr)


cases = [("basin_threads%d" % n, lambda bench, n=n: basin(bench, n)) for n in (0, 1, 2)]
cases += [("files", files), ("veil", veil), ("origins", origins), ("jumps", jumps), ("surface", surface), ("moves", moves),
          ("loop_closure", loop_closure), ("saving", saving), ("one_folder", one_folder), ("replay", replay),
          ("killed", killed), ("exports", exports), ("refusals", refusals)]

run(cases, parallel=3, gate=("refusals", "one_folder", "origins"))
