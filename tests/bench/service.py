#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""service.py [SECONDS] - what the service costs with nothing configured but its sonar: a virtual Ping360 at its own rate on
a line of 115200 baud, default configuration; aims: below 1 % of a processor, below 32 MiB. The virtual line hands over
smaller pieces than most serial adapters do, and every piece wakes the service once. Then the same with all that the
service can keep: voxel map, image clean-up, two threads,
recording."""
import os
import shutil
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "live"))
from lib import Bench, pings_until  # noqa: E402  (the path comes first)

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 20
TICK = os.sysconf("SC_CLK_TCK")


def processor_s(pid):
    """utime + stime."""
    with open("/proc/%d/stat" % pid, encoding="ascii") as f:
        fields = f.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def memory_mib(pid, key):
    with open("/proc/%d/smaps_rollup" % pid, encoding="ascii") as f:
        return int([line for line in f if line.startswith(key + ":")][0].split()[1]) / 1024


def waits(pid):
    """How often any thread has slept and been woken."""
    total = 0
    for thread in os.listdir("/proc/%d/task" % pid):
        with open("/proc/%d/task/%s/status" % (pid, thread), encoding="ascii") as f:
            total += int([line for line in f if line.startswith("voluntary")][0].split()[1])
    return total


def measure(name, more):
    bench = Bench()
    try:
        bench.sim(quick=False)
        text = "[sonar head]\ndevice = ping360\nport = serial:%s:115200\n[server]\nsocket = %s\n" % (
            bench.port_path, bench.socket_path)
        daemon = bench.sonard(conf=bench.write("sonard.conf", text + more.replace("FOLDER", bench.folder)))
        client = daemon.client()
        client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 5])
        pings_until(client, 10)
        pings, used, woken, begin = client.sensor()["pings"], processor_s(daemon.pid), waits(daemon.pid), time.monotonic()
        time.sleep(SECONDS)
        took = time.monotonic() - begin
        used, woken = processor_s(daemon.pid) - used, waits(daemon.pid) - woken
        print("%-30s %8.1f %8.0f %10.2f %8.1f %8.1f" % (
            name, (client.sensor()["pings"] - pings) / took, woken / took, 100 * used / took,
            memory_mib(daemon.pid, "Rss"), memory_mib(daemon.pid, "Pss")), flush=True)
    finally:
        for fault in bench.end():
            print("# " + fault)
        shutil.rmtree(bench.folder, ignore_errors=True)


print("%-30s %8s %8s %10s %8s %8s" % ("", "pings/s", "wakes/s", "% of a CPU", "RSS MiB", "PSS MiB"))
measure("default", "")
measure("map, clean-up, threads, record", """[pose]
max_age = 1 h
[map]
voxel = 0.2 m
directory = FOLDER
[extract]
median = 3
otsu = on
[pipeline]
threads = 2
[record]
directory = FOLDER
""")
