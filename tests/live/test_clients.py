#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Clients that are slow, greedy, broken or hostile, all at once: one that behaves does not notice."""
import json
import select
import socket
import threading
import time

from lib import PATIENCE, SANITIZER, check, note, pings_until, run, until

QUESTION = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "sectors"}).encode() + b"\n"
WATCH = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "watch",
                    "params": {"method": "sectors", "rate_hz": 50}}).encode() + b"\n"


def connect(bench):
    made = socket.socket(socket.AF_UNIX)
    made.connect(bench.socket_path)
    made.setblocking(False)
    return made


def push(made, data):
    """As much as goes; False when the daemon has closed."""
    try:
        made.send(data)
    except BlockingIOError:
        pass
    except OSError:
        return False
    return True


class Crowd(threading.Thread):
    """Keeps up its mischief until it is told to end; who was cut off comes again."""

    KINDS = (
        ("half a line and silence", b'{"jsonrpc":"2.0","id":1,', False),
        ("floods and reads nothing", 200 * QUESTION, True),
        ("watches and reads nothing", WATCH, False),
        ("an endless line", b"x" * 65536, True),
        ("deep nesting", b"[" * 60000 + b"\n", True),
        ("noise", bytes(range(256)) * 64, True),
        ("comes and goes", b"", True),
    )

    def __init__(self, bench, each):
        super().__init__()
        self.bench = bench
        self.slots = [[kind, None] for kind in self.KINDS for _ in range(each)]
        self.done = threading.Event()
        self.came = 0

    def step(self, slot):
        (_, data, again), made = slot
        if made is None:
            slot[1] = made = connect(self.bench)
            self.came += 1
            push(made, data)
        elif not data or (again and not push(made, data)) or self.closed(made):
            made.close()
            slot[1] = None

    def closed(self, made):
        return bool(select.select([made], [], [], 0)[0]) and made.recv(1, socket.MSG_PEEK) == b""

    def run(self):
        while not self.done.wait(0.005):
            for slot in self.slots:
                try:
                    self.step(slot)
                except OSError:
                    slot[1] = None
        for _, made in self.slots:
            if made:
                made.close()


def memory_kib(pid):
    with open("/proc/%d/status" % pid, encoding="ascii") as f:
        return int([line for line in f if line.startswith("VmRSS")][0].split()[1])


def ask(client, span_s):
    """Sorted times in milliseconds from question to answer, asked at 50 Hz; every answer must be whole."""
    times, end = [], time.monotonic() + span_s
    while time.monotonic() < end:
        begin = time.monotonic()
        check(len(client.call("sectors")["sectors"]) == 72, "a broken answer")
        times.append(1e3 * (time.monotonic() - begin))
        time.sleep(0.02)
    return sorted(times)


def crowd(bench):
    bench.sim()
    bench.conf()
    daemon = bench.sonard()
    good = daemon.client()
    good.call("watch", method="sectors", rate_hz=10)
    pings_until(good, 20)
    alone = ask(good, 2)
    others = Crowd(bench, 6)
    others.start()
    try:
        ask(good, 2)
        before, pings = memory_kib(daemon.pid), good.sensor()["pings"]
        among = ask(good, 8)
        after, sensor = memory_kib(daemon.pid), good.sensor()
    finally:
        others.done.set()
        others.join()
    server = good.call("status")["server"]
    note("%d hostile clients, %d connections, %d cut off, %d requests; from question to answer, median and 99th "
         "percentile: %.1f and %.1f ms alone, %.1f and %.1f ms among them; memory %d -> %d KiB"
         % (len(others.slots), others.came, server["clients_cut"], server["requests"], alone[len(alone) // 2],
            alone[len(alone) * 99 // 100], among[len(among) // 2], among[len(among) * 99 // 100], before, after))
    check(server["clients_cut"] > 0, "nobody was cut off")
    check(sensor["pings"] > pings + 50 and sensor["dropped"] == 0, "the sonar waited for clients: %s" % sensor)
    check(among[len(among) // 2] < 250 * PATIENCE, "an answer takes %.0f ms" % among[len(among) // 2])
    check(SANITIZER or after < before + 8192, "memory grew from %d to %d KiB" % (before, after))
    check(len(good.notifications) > 30, "the watch told %d times in 12 s" % len(good.notifications))
    until(lambda: good.call("status")["server"]["clients_now"] == 1, "the others to be gone")


run([("clients_crowd", crowd)])
