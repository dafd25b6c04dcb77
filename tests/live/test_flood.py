#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""A thousand clients that watch as much as they can and never read: others are answered as if they were alone."""
import json
import math
import os
import resource
import time

from lib import Client, PATIENCE, check, note, run, until

CLIENTS = 1000
SPAN_S = 2
ROUNDS = 4, 12      # at least, and at most: the 99 % of a short time on a busy machine are chance
LIMIT = 3 * PATIENCE
WATCHES = 16 * (json.dumps({"jsonrpc": "2.0", "id": 1, "method": "watch",
                            "params": {"method": "version", "rate_hz": 50}}).encode() + b"\n")


def connect(bench):
    """However many connect at the same time."""
    while True:
        try:
            return Client(bench.socket_path)
        except BlockingIOError:
            time.sleep(0.01)


def ask(client, span_s):
    """Times in milliseconds from question to answer."""
    times, end = [], time.monotonic() + span_s
    while time.monotonic() < end:
        begin = time.monotonic()
        client.call("blocked", azimuth_deg=0, distance_m=3)
        times.append(1e3 * (time.monotonic() - begin))
        time.sleep(0.005)
    return times


def at(times, share):
    return sorted(times)[int(len(times) * share)]


def cpu_s(pid):
    """Processor time that a process has used."""
    with open("/proc/%d/stat" % pid, encoding="ascii") as f:
        fields = f.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Span:
    """All times of one kind, and what the daemon needed meanwhile."""

    def __init__(self, daemon, client):
        self.daemon, self.client = daemon, client
        self.times, self.lasted_s, self.used_s = [], 0.0, 0.0

    def ask(self):
        begin, before = time.monotonic(), cpu_s(self.daemon.pid)
        self.times += ask(self.client, SPAN_S)
        self.lasted_s += time.monotonic() - begin
        self.used_s += cpu_s(self.daemon.pid) - before

    def share(self):
        return self.used_s / self.lasted_s


def rush(bench, good):
    """All come and have all their watches, or a refusal of them."""
    asked = good.call("status")["server"]["requests"]
    others = [connect(bench) for _ in range(CLIENTS)]
    for other in others:
        other.send(WATCHES)
    until(lambda: good.call("status")["server"]["requests"] >= asked + 16 * CLIENTS, "all their requests", 60)
    return others


def flood(bench):
    """They come and go: whatever else this machine does is there with them and without them."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
    bench.sim()
    bench.conf(server={"max_clients": 1024, "client_timeout": "60 s"})
    daemon = bench.sonard()
    good = daemon.client()
    alone, among = Span(daemon, good), Span(daemon, good)
    ratio, rounds = math.inf, 0
    while rounds < ROUNDS[0] or (ratio > LIMIT and rounds < ROUNDS[1]):
        alone.ask()
        others = rush(bench, good)
        among.ask()
        check(good.call("status")["server"]["clients_now"] == CLIENTS + 1, "they are not all there")
        for other in others:
            other.close()
        until(lambda: good.call("status")["server"]["clients_now"] == 1, "the others to be gone")
        ratio, rounds = at(among.times, .99) / at(alone.times, .99), rounds + 1
    note("from question to answer, median and 99 %%: %.2f and %.2f ms alone, %.2f and %.2f ms among %d clients: "
         "%.1f times, of %d and %d questions in %d rounds; the daemon is busy for %.1f %% and %.1f %% of the time"
         % (at(alone.times, .5), at(alone.times, .99), at(among.times, .5), at(among.times, .99), CLIENTS, ratio,
            len(alone.times), len(among.times), rounds, 100 * alone.share(), 100 * among.share()))
    check(ratio <= LIMIT, "99 %% of the answers take %.1f times as long" % ratio)


def deaf(bench):
    """Clients that never read do not keep the places for ever."""
    bench.sim()
    bench.conf(server={"max_clients": 4, "client_timeout": "3 s"})
    daemon = bench.sonard()
    others = [daemon.client() for _ in range(5)] # the one more is the owner's
    for other in others:
        other.send(4 * WATCHES)

    def served():
        client = connect(bench)
        try:
            client.send(b'{"jsonrpc":"2.0","id":1,"method":"version"}\n')
            return b"protocol" in (client.line() or b"")
        except OSError: # refused, and closed before it could ask
            return False
        finally:
            client.close()

    until(served, "a place for one more", 60)
    until(lambda: "client cut off" in daemon.log(), "the log of it")


run([("flood_of_watches", flood), ("flood_deaf", deaf)])
