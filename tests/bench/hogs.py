#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""hogs.py [SECONDS] - from a ping's last byte to the picture, in microseconds: alone, beside programs that take every
processor twice over and write through memory without end, and the same with [realtime]. Two pipeline threads, fifty
pings a second from a virtual Ping360 whose motor has no weight."""
import multiprocessing
import os
import shutil
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "live"))
from lib import Bench, pings_until  # noqa: E402  (the path comes first)

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 10
MEMORY = 256 << 20


def spin():
    while True:
        pass


def write_memory():
    block = bytearray(MEMORY)
    page = bytes(4096)
    while True:
        for at in range(0, MEMORY, 4096):
            block[at:at + 4096] = page


def may_have_priority():
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(40))
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        return os.geteuid() == 0
    except PermissionError:
        return False


def measure(name, hogs, **realtime):
    bench = Bench()
    beside = [multiprocessing.Process(target=what, daemon=True) for what in hogs]
    try:
        bench.sim("--ms-per-gradian", "0.1", "--processing-ms", "1")
        bench.conf(pipeline={"threads": 2}, realtime=realtime, log={"level": "warning"})
        client = bench.sonard().client()
        pings_until(client, 10)
        for hog in beside:
            hog.start()
        first = client.call("status")["pipeline"]
        time.sleep(SECONDS)
        last = client.call("status")["pipeline"]
        took = last["latency_us"]
        print("%-28s %8.0f %9.0f %9.0f %9.0f %9.0f %8d" % (
            name, (last["pings"] - first["pings"]) / SECONDS, took["p50"], took["p99"], took["p999"], took["max"],
            last["dropped"]), flush=True)
    finally:
        for hog in beside:
            hog.kill()
            hog.join()
        for fault in bench.end():
            print("# " + fault)
        shutil.rmtree(bench.folder, ignore_errors=True)


print("%-28s %8s %9s %9s %9s %9s %8s" % ("", "pings/s", "p50 us", "p99 us", "p99.9 us", "max us", "dropped"))
crowd = [spin] * (2 * os.cpu_count()) + [write_memory]
measure("alone", [])
measure("beside hogs", crowd)
if may_have_priority():
    measure("alone, [realtime]", [], priority=40, lock_memory="on")
    measure("beside hogs, [realtime]", crowd, priority=40, lock_memory="on")
else:
    print("# this user may not have SCHED_FIFO and locked memory: [realtime] was not measured")
