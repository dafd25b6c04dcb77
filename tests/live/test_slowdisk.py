#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""A disk that takes seconds: who saves and loads waits for it, and nobody else does."""
import os
import threading
import time

from lib import SANITIZER, Skipped, check, helper, note, pings_until, run, until

SLOW_MS = 1000  # each read and sync; a save has three of them, a load two


class Others(threading.Thread):
    """Somebody else, who asks all the time meanwhile; the longest wait."""

    def __init__(self, daemon):
        super().__init__(daemon=True)
        self.client = daemon.client()
        self.ended = threading.Event()
        self.longest_s, self.answers = 0.0, 0

    def run(self):
        while not self.ended.wait(0.01):
            begun = time.monotonic()
            self.client.call("blocked", azimuth_deg=0, distance_m=5)
            self.longest_s = max(self.longest_s, time.monotonic() - begun)
            self.answers += 1

    def stop(self):
        self.ended.set()
        self.join()
        self.client.close()


def while_others_ask(daemon, what, work):
    others = Others(daemon)
    others.start()
    begun = time.monotonic()
    work()
    took_s = time.monotonic() - begun
    others.stop()
    note("%s took %.1f s, a question meanwhile %.0f ms at most" % (what, took_s, others.longest_s * 1e3))
    check(took_s >= 2, "%s took %.1f s: the disk is not slow, this test shows nothing" % (what, took_s))
    check(others.answers > 50, "%s: only %d questions were answered meanwhile" % (what, others.answers))
    check(others.longest_s < 0.5, "%s: a question waited for %.2f s" % (what, others.longest_s))


def slow(bench, threads):
    if SANITIZER:
        raise Skipped("a sanitizer needs to be loaded first")
    disk = bench.path("disk")
    os.mkdir(disk)
    bench.sim("--frame", "200,20,0.8", "--ms-per-gradian", "0.2", "--processing-ms", "0.5", quick=False)
    bench.conf(sonar={"background": os.path.join(disk, "head.bg"), "step": "9 deg"}, pose={"max_age": "60 s"},
               map={"voxel": "0.5 m", "directory": disk}, pipeline={"threads": threads})
    daemon = bench.sonard(env={"LD_PRELOAD": helper("slowdisk.so"), "SLOWDISK_FOLDER": disk,
                               "SLOWDISK_MS": str(SLOW_MS)})
    client = daemon.client()

    def said():
        client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 2])
        return client.call("map")
    until(lambda: said()["pings"] > 40, "pings in the map", 60)
    client.call("background_learn", pings=2, motion="any")
    until(lambda: client.call("background")["template"], "the template to be learnt", 60, 0.05)

    def job(method, **params):
        client.call(method, **params)
        until(lambda: client.call("map")["job"]["state"] != "running", method, 60)
        check(client.call("map")["job"]["state"] == "done", str(client.call("map")["job"]))
    for number in range(2):  # what is there is read before it is replaced
        while_others_ask(daemon, "map_save", lambda: job("map_save", name="kept"))
        if number == 0:
            while_others_ask(daemon, "map_export", lambda: job("map_export", name="kept", format="ply"))
    while_others_ask(daemon, "map_load", lambda: job("map_load", name="kept"))
    while_others_ask(daemon, "background_save", lambda: client.call("background_save"))
    while_others_ask(daemon, "background_load", lambda: client.call("background_load"))
    check(client.call("background")["template"]["saved"], "loaded, and not as it is in the file")
    pings_until(client, 3)


run([("slow_disk_threads%d" % n, lambda bench, n=n: slow(bench, n)) for n in range(3)], parallel=3)
