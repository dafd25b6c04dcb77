#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Two hundred clients at once, polite and rude, for SECONDS (3) each time, on the picture of a replay that has ended: every answer is
the one that a single plain client gets, byte for byte, and when they are gone the daemon is as large as before."""
import json
import os
import subprocess

from lib import PATIENCE, SANITIZER, check, helper, note, run, until

SECONDS = float(os.environ.get("SECONDS") or 3)


def question(method, /, **params):
    return json.dumps({"jsonrpc": "2.0", "id": 7, "method": method, "params": params})


COMMON = [question("blocked", azimuth_deg=azimuth, distance_m=1.5, half_angle_deg=5) for azimuth in range(0, 360, 30)]
COMMON += [question("sectors"), question("limit", velocity_mps=[0.5, 0, 0])]
ALL = COMMON + [
    question("sectors", count=360), question("sectors", count=8, elevation_deg=[-30, 30]),
    question("nearest"), question("nearest", azimuth_deg=90, half_angle_deg=45),
    question("time_to_collision", velocity_mps=[0.5, 0.1, 0]), question("limit", velocity_mps=[0.1, 0, 0]),
    question("explain", azimuth_deg=90, distance_m=2), question("clusters"), question("next_look"), question("version"),
    question("grid_list"), question("background"), question("plan"), question("image", sensor="box"),
    question("map"), question("map_slice"), question("point", position_m=[1, 0, 0]),
    question("path", points_m=[[0, 0, 0], [1, 0, 0]], radius_m=0.2),
    question("explode"), question("blocked", azimuth_deg="north"), "{", "[]",
    "[%s,%s]" % (question("version"), question("sectors")),
]


def memory_kib(pid):
    with open("/proc/%d/status" % pid, encoding="ascii") as f:
        return int([line for line in f if line.startswith("VmRSS")][0].split()[1])


def load(bench, threads):
    conf = bench.write("load.conf", "[sonar box]\ndevice = ping360\nport = serial:/dev/ttyUSB0:115200\nrange = 2 m\n"
                       "[server]\nmax_clients = 256\n[pipeline]\nthreads = %d\n[map]\nvoxel = 0.2 m\n[log]\nlevel = warning\n"
                       % threads)
    daemon = bench.sonard("--replay", "tests/replay/box.mcap", "--stay", "--socket", bench.socket_path, conf=conf)
    client = daemon.client()
    until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay")

    def crowd(questions):
        done = subprocess.run([helper("load"), bench.socket_path, "%g" % SECONDS], input="\n".join(questions) + "\n",
                              capture_output=True, text=True, timeout=SECONDS + 60 * PATIENCE, check=False)
        check(done.returncode == 0 and "answers=0 " not in done.stdout, done.stdout + done.stderr)
        until(lambda: client.call("status")["server"]["clients_now"] == 1, "the crowd to be gone")
        return done.stdout.strip(), memory_kib(daemon.pid)
    told, _ = crowd(COMMON)
    note("%d threads, blocked, sectors and limit: %s" % (threads, told))
    # the heap finds its size in some rounds, and freed memory comes back in other pieces; what leaks grows in all rounds
    sizes = [crowd(ALL)[1]]
    while len(sizes) < 3 or (sizes[-1] > sizes[-2] + 256 and len(sizes) < 10):
        told, size = crowd(ALL)
        sizes.append(size)
    note("%d threads, all that can be asked: %s; memory after each round: %s KiB" % (threads, told, sizes))
    check(SANITIZER or sizes[-1] <= sizes[-2] + 256, "memory grows in every round: %s KiB" % sizes)


run([("load_threads%d" % n, lambda bench, n=n: load(bench, n)) for n in (0, 2)])
