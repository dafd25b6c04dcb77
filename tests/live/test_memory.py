#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""test_memory - what clients needed is given back when they have left. Measures memory: a long target, not the gate."""
import json
import os
import select
import socket
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from lib import SANITIZER, check, note, pings_until, run, until  # noqa: E402

CLIENTS = 300
MARGIN_MB = 10


def resident_mb(daemon):
    with open("/proc/%d/status" % daemon.process.pid, encoding="ascii") as f:
        return next(int(line.split()[1]) for line in f if line.startswith("VmRSS")) / 1024


def settled_mb(daemon):
    """What stays once nobody asks."""
    least = resident_mb(daemon)
    for _ in range(30):
        time.sleep(0.1)
        least = min(least, resident_mb(daemon))
    return least


def watcher(bench, rate_hz):
    client = socket.socket(socket.AF_UNIX)
    client.connect(bench.socket_path)
    client.sendall(json.dumps({"jsonrpc": "2.0", "id": 1, "method": "watch",
                               "params": {"method": "image", "rate_hz": rate_hz}}).encode() + b"\n")
    return client


def watched(bench, reads):
    bench.sim(scene="box", quick=True)
    bench.conf(server={"max_clients": CLIENTS + 20}, sonar={"step": "0.9 deg"})
    daemon = bench.sonard()
    client = daemon.client()
    pings_until(client, 800, 60)
    before = settled_mb(daemon)
    watchers = [watcher(bench, 2) for _ in range(CLIENTS)]
    end, got, most = time.monotonic() + 10, 0, 0
    while time.monotonic() < end:
        most = max(most, resident_mb(daemon))
        for ready in select.select(watchers if reads else [], [], [], 0.2)[0]:
            got += len(ready.recv(1 << 20))
    for one in watchers:
        one.close()
    until(lambda: client.call("status")["server"]["clients_now"] <= 2, "all to have left")
    after = settled_mb(daemon)
    note("%.1f MB before, %.1f MB with %d image watchers (%.1f MB read), %.1f MB after" %
         (before, most, CLIENTS, got / 1e6, after))
    check(SANITIZER or after <= before + MARGIN_MB, "%.1f MB before, %.1f MB after" % (before, after))


def readers(bench):
    watched(bench, True)


def who_read_nothing(bench):
    watched(bench, False)


run([("memory_of_readers", readers), ("memory_of_who_read_nothing", who_read_nothing)])
