#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""A day in virtual time, played as fast as it goes: a capture of HOURS (24) hours of a Ping360 that stands in a round basin,
six pings and a pose a second, and a log of so many hours of a CAN bus with two sonars. Every answer about the last hours is
that of the second hour, and memory is flat from then on."""
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "live"))
from made_capture import MadeCapture  # noqa: E402

BUILD = os.environ.get("BUILD", "build")
SONARD = os.path.join(BUILD, "sonard")
HOURS = float(os.environ.get("HOURS") or 24)
START_NS = 1_700_000_000 * 10**9
PINGS_PER_S, BINS, WALL_BIN = 6, 200, 120
WALL_M = 6.0
EVERY_S = 1800
GROWN_MAX_KIB = 1024

CONF = """[log]
level = warning
[sonar head]
device = ping360
port = serial:/dev/none:115200
range = 10 m
[map]
voxel = 0.2 m
memory = 8 MiB
"""
CAN_RANGE_M = 8.0
CAN_CONF = """[log]
level = warning
[sonar ahead]
device = dronecan
port = can:can0
range = 20 m
[sonar floor]
device = nmea2000
port = can:can0
rotation = 0 -90 0 deg
range = 20 m
"""


def frame(angle):
    """What a Ping360 sends of one ping: ring-down, silence, a wall, silence."""
    samples = bytes([255] * 8 + [10] * (WALL_BIN - 8) + [200] * 4 + [12] * (BINS - WALL_BIN - 4))
    payload = struct.pack("<BBHHHHHH", 1, 0, angle, 11, 2666, 750, BINS, BINS) + samples
    head = b"BR" + struct.pack("<HHBB", len(payload), 2300, 2, 0) + payload
    return head + struct.pack("<H", sum(head) & 0xFFFF)


def write_capture(path):
    frames = [frame(angle) for angle in range(400)]
    made = MadeCapture(path, ("/head/rx", "octet-stream"), ("/pose", "json"))
    for second in range(int(HOURS * 3600)):
        t_ns = START_NS + second * 10**9
        pose = json.dumps({"t_unix": t_ns / 1e9, "attitude_deg": [0, 0, 90], "position_m": [0, 0, 5]}).encode()
        made.write([(2, t_ns, pose)] + [(1, t_ns + k * 10**9 // PINGS_PER_S, frames[(second * PINGS_PER_S + k) % 400])
                                        for k in range(PINGS_PER_S)])
    made.end()


def write_log(path):
    """What a DroneCAN range sensor and an NMEA 2000 transducer say on one bus."""
    with open(path, "wb") as f:
        subprocess.run([os.path.join(BUILD, "tests", "can_sim"), "--log", "--dronecan", "42", "--rate", "2", "--nmea2000", "35",
                        "--range", "%g" % CAN_RANGE_M, "--seconds", "%g" % (HOURS * 3600), "can0"], stdout=f, check=True)


def resident_kib(pid):
    with open("/proc/%d/status" % pid, encoding="ascii") as f:
        return int(next(line.split()[1] for line in f if line.startswith("RssAnon:")))


def states(answer):
    return [(s["state"], None if s["range_m"] is None else round(s["range_m"], 1)) for s in answer["sectors"]["sectors"]]


def basin(timed):
    """The wall stands around, all before it is free, and nothing changes after the first hours."""
    sectors = [states(answer) for answer in timed]
    seen = [m for _, m in sectors[-1] if m is not None and abs(m - WALL_M) < 0.3]
    return len(seen) == len(sectors[-1]) and all(now == sectors[2] for now in sectors[2:])


def ahead(timed):
    """What the range sensor sees is where it is, in every answer."""
    nearest = [min((m for _, m in states(answer) if m is not None), default=math.inf) for answer in timed]
    return all(abs(m - CAN_RANGE_M) < 0.3 for m in nearest)


def play(name, write, conf_text, good_answers):
    """A replay to its end, every answer of it and its memory judged."""
    with tempfile.TemporaryDirectory(prefix="sonard-soak-") as folder:
        capture, conf, answers = (os.path.join(folder, file) for file in ("day", "conf", "answers"))
        with open(conf, "w", encoding="ascii") as f:
            f.write(conf_text)
        write(capture)
        begun, memory = time.monotonic(), []
        daemon = subprocess.Popen([SONARD, "-c", conf, "--replay", capture, "--answers", answers, "--every",
                                   str(EVERY_S), "--socket", "none"])
        while daemon.poll() is None:
            try:
                memory.append(resident_kib(daemon.pid))
            except (OSError, StopIteration):
                pass
            time.sleep(0.05)
        with open(answers, encoding="ascii") as f:
            timed = [answer for answer in map(json.loads, f) if answer["event"] == "time"]
        early = memory[len(memory) // 4] if memory else 0
        grown = memory[-1] - early if memory else 0
        print("# %s: %g hours in %.0f s: %d answers; memory %d KiB, grown by %d KiB"
              % (name, HOURS, time.monotonic() - begun, len(timed), early, grown))
        good = (daemon.returncode == 0 and len(timed) >= HOURS * 3600 / EVERY_S - 1 and good_answers(timed) and
                grown <= GROWN_MAX_KIB)
        print("ok soak_%s" % name if good else "FAIL soak_%s: ended with %s" % (name, daemon.returncode), flush=True)
        return good


good = [play("virtual_day", write_capture, CONF, basin), play("virtual_day_of_can", write_log, CAN_CONF, ahead)]
sys.exit(0 if all(good) else 1)
