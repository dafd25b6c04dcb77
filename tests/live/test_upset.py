#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""What the world around does to a running sonard: the disk stalls."""
import glob
import os
import re
import socket
import time

from lib import SANITIZER, Skipped, check, free_port, helper, note, pings_until, run, until


def upset(bench, *arguments, **kinds):
    if SANITIZER:
        raise Skipped("a sanitizer needs to be loaded first")
    env = {"UPSET_" + kind.upper(): bench.path(file) for kind, file in kinds.items()}
    return bench.sonard(*arguments, env=dict(env, LD_PRELOAD=helper("upset.so")))


def rate(client, seconds):
    """Pings per second, and the longest that a question waited for its answer."""
    first, begin, longest = client.sensor()["pings"], time.monotonic(), 0
    while time.monotonic() < begin + seconds:
        asked = time.monotonic()
        pings = client.sensor()["pings"]
        longest = max(longest, time.monotonic() - asked)
        time.sleep(0.02)
    return (pings - first) / (time.monotonic() - begin), longest


def stalled_disk(bench):
    """The disk does not come back, for longer than the daemon can hold what comes: no ping waits for it, what is lost is
    counted, and when it is back all goes on; what was recorded can be read."""
    bench.sim()
    folder = bench.path("captures")
    far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    far.bind(("127.0.0.1", 0))
    near = ("127.0.0.1", free_port())
    bench.conf(**{"sonar noise": {"device": "ping1d", "mode": "transmit",
                                  "port": "udp:127.0.0.1:%d:%d" % (far.getsockname()[1], near[1])}})
    client = upset(bench, "--record", folder, disk="stalled").client()

    def record():
        return client.call("status")["record"]
    pings_until(client, 50)
    usual, _ = rate(client, 2)
    check(record()["messages"] > 0 and record()["lost_messages"] == 0, "before: %s" % record())

    bench.write("stalled", "")
    until(lambda: record()["waiting_bytes"] > 0, "something to wait for the disk")
    stalled, longest = rate(client, 2)
    note("%.0f pings/s, %.0f with a stalled disk; the longest answer took %.0f ms" % (usual, stalled, 1e3 * longest))
    check(stalled > 0.6 * usual, "%g pings/s with a stalled disk, %g without" % (stalled, usual))
    check(record()["lost_messages"] == 0, "lost at once: %s" % record())

    def fill():
        for _ in range(20):
            far.sendto(bytes(60000), near)
        return record()["overflows"] > 0
    until(fill, "all room to be taken", every_s=0.01)
    full, _ = rate(client, 2)
    check(full > 0.6 * usual, "%g pings/s with all room taken, %g without" % (full, usual))
    lost = record()
    check(lost["lost_messages"] == lost["overflows"] > 0, "what is lost is not counted: %s" % lost)

    os.remove(bench.path("stalled"))
    until(lambda: record()["waiting_bytes"] == 0, "the disk to catch up")
    pings_until(client, 20)
    after = record()
    check(after["recording"] and after["error"] == "", "after: %s" % after)
    until(lambda: "the disk is too slow" in bench.processes[-1].log(), "the loss to be said")
    far.close()
    check(bench.processes[-1].stop() == 0, "the daemon's end")
    messages = 0
    for capture in glob.glob(os.path.join(folder, "*.mcap")):
        info = bench.sonarctl("capture", "info", capture)
        check(info.returncode == 0, "capture info: " + info.stderr)
        messages += sum(int(n) for n in re.findall(r"^(\d+) messages? in", info.stdout, re.M))
    note("%d messages in the captures; %d were taken, %d lost" % (messages, after["messages"], after["lost_messages"]))
    check(messages >= after["messages"] - after["lost_messages"] - 1, "fewer in the capture than were not lost")


run([("stalled_disk", stalled_disk)])
