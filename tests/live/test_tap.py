#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The tap of a live daemon: what the sonar says can be listened to, and nothing that is done there harms."""
import os
import select
import time

from lib import PATIENCE, check, pings_until, run, until
from twin import Twin


def start(bench):
    Twin(bench, "echolist_sim")
    tap = bench.path("front.tty")
    bench.conf(sonar={"device": "echolist", "tap": tap})
    daemon = bench.sonard()
    return daemon, daemon.client(), tap


def listen(tap, wanted, limit_s=20):
    """Bytes from the tap until `wanted` is among them."""
    fd = os.open(tap, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    end = time.monotonic() + limit_s * PATIENCE
    heard = b""
    try:
        while wanted not in heard:
            check(select.select([fd], [], [], max(0, end - time.monotonic()))[0], "the tap says nothing")
            heard += os.read(fd, 4096)
    finally:
        os.close(fd)
    return heard


def case_listens_in(bench):
    _, client, tap = start(bench)
    pings_until(client, 3)
    for _ in range(3):
        heard = listen(tap, b"\r\n$ECHO")
        check(heard.count(b"$ECHO") >= 1, "heard %r" % heard)
    pings_until(client, 3)


def case_harms_nobody(bench):
    """A reader that never reads, and one that writes."""
    _, client, tap = start(bench)
    pings_until(client, 3)
    fd = os.open(tap, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    os.write(fd, b"$ECHO,0,0,1,1000,100\r\n" * 20)
    until(lambda: client.sensor()["tap_refused_bytes"] == 440, "the bytes to be thrown away")
    until(lambda: client.sensor()["tap_lost_bytes"] > 0, "the tap to be full", 60)
    before = client.sensor()
    pings_until(client, 10)
    after = client.sensor()
    check(after["garbage_bytes"] == before["garbage_bytes"] and after["bad_frame"] == 0, str(after))
    os.close(fd)


def case_link(bench):
    daemon, client, tap = start(bench)
    pings_until(client, 1)
    check(os.path.islink(tap) and os.readlink(tap).startswith("/dev/pts/"), "no link to a terminal")
    check(daemon.stop() == 0, "it does not end well")
    check(not os.path.lexists(tap), "the link is still there")


def case_place_taken(bench):
    """A file where the link should be: it stays, and the sonar is read all the same."""
    bench.write("front.tty", "mine")
    daemon, client, tap = start(bench)
    pings_until(client, 3)
    with open(tap, encoding="ascii") as f:
        check(f.read() == "mine", "the file was touched")
    check("not a symbolic link" in daemon.log(), "nothing was said")


run([("tap_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")],
    parallel=3)
