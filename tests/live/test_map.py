#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The voxel map of a running daemon: folders, kills, readers of others, and what is refused. tests/voyage/test_map.py asks it."""
import glob
import hashlib
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

from lib import check, expect_refusal, note, pings_until, run, until
from map_truth import VOXEL, check_points, done, job, state_of

TURN = 200                             # pings of a full circle at 1.8 degrees
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


def conf(bench, threads=0, **keys):
    section = {"voxel": "%g m" % VOXEL, "opening": 1, "memory": "48 MiB", "directory": bench.folder}
    section.update(keys)
    bench.conf(map=section, pipeline={"threads": threads})


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


def basin(bench, threads):
    """The whole chain with a vehicle under way; tests/voyage/test_map.py asks about the same water in full."""
    sim = bench.sim()
    conf(bench, threads)
    client = dive(bench, bench.sonard(), sim)
    free = check_points(client, random.Random(7), lag_m=LAG_M)
    status = client.call("map")
    check(status["state"] == "kept" and status["pings"] > 4 * TURN and status["starved"] == 0, str(status))
    note("%d threads: %d of 1500 points free, none behind a wall" % (threads, free))


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
    check_points(client, dice, 100, LAG_M)  # how much a vehicle under way has seen depends on the machine
    before = client.call("map")["submaps"]
    with open(done(client, "map_save", name="rest"), "rb") as f:
        count = struct.unpack("<I", f.read(16)[12:])[0]
    after = client.call("map")["submaps"]  # pings go on, and the oldest may be dropped meanwhile
    check(min(before, after) <= count <= max(before, after), "%d submaps saved of %d, then %d" % (count, before, after))
    done(client, "map_export", name="rest")
    expect_refusal(client, "map_save", {"name": "dropped-1"}, "take another")
    done(client, "map_load", name="dropped-1")
    brought = client.call("map_submaps")["submaps"][0]
    check(brought["pings"] > 50 and brought["begin_age_s"] is None, brought)
    daemon.stop()
    check(len(glob.glob(os.path.join(maps, "dropped-*.map"))) >= 3, os.listdir(maps))
    check_folder_gone(bench, sim, maps)
    replay_all(bench, captures, maps)


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
    os.rename(maps, maps + ".gone")  # at once, whatever the daemon just writes there
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
    """What is exported is read by the libraries of others, where they are."""
    sim = bench.sim()
    conf(bench)
    client = dive(bench, bench.sonard(), sim)
    sim.command("silent 1000")
    time.sleep(0.5)
    with open(done(client, "map_export", name="surface"), "rb") as f:
        count = int(f.read().split(b"element vertex ")[1].split()[0])
    mcap = done(client, "map_export", name="surface", format="mcap")
    read = subprocess.run(["tests/mcap/check.sh", mcap], text=True, capture_output=True, check=False, timeout=300)
    check(read.returncode == 0 and ("%d points" % count in read.stdout or read.stdout.startswith("skip")),
          read.stdout + read.stderr)
    note(read.stdout.strip())
    check_octomap(bench, client, done(client, "map_export", name="tree", format="bt"))


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
    wrong = [(p, a, b) for p, a, b in zip(places, said, lines[1:]) if a != b]
    check(not wrong, "%d places differ, the first %s" % (len(wrong), wrong[:1]))
    note("OctoMap reads %d nodes; %d places, %d of them free, are the same" % (size, len(places), said.count("free")))


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
            expect_refusal(client, method, {"name": name}, "expected a file name", -32602)
    bad = bench.path("bad.conf")
    with open(bench.path("sonard.conf"), encoding="ascii") as f:
        text = f.read()
    with open(bad, "w", encoding="ascii") as f:
        f.write(text.replace("voxel = 0.2 m", "voxel = 9 m"))
    faults = bench.run(os.path.join(os.environ.get("BUILD", "build"), "sonard"), "--check", bad)
    check(faults.returncode == 1 and "voxel" in faults.stderr and "bad.conf:" in faults.stderr, faults.stderr)


cases = [("basin_threads0", lambda bench: basin(bench, 0)), ("basin_threads2", lambda bench: basin(bench, 2)),
         ("origins", origins), ("loop_closure", loop_closure), ("saving", saving), ("one_folder", one_folder),
         ("killed", killed), ("exports", exports), ("refusals", refusals)]

run(cases, parallel=3, gate=("refusals", "one_folder", "origins"))
