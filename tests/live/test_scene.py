#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""What sonard answers about a scene against what the virtual sonar knows is there."""
import threading
import time

from lib import Failed, check, note, pings_until, run, until
from scene_truth import TURN, all_unknown, apart, check_blocked, check_sectors, check_wall


def start(bench, threads, mode, firmware, scene):
    sim = bench.sim("--firmware", firmware, scene=scene, truth=True)
    bench.conf(sonar={"mode": mode}, pipeline={"threads": threads})
    return sim, bench.sonard().client()


def box(bench, threads, mode, firmware):
    """The whole chain over a serial line and over a polled one; tests/voyage/test_scene.py has all others."""
    _, client = start(bench, threads, mode, firmware, "box")
    pings_until(client, TURN + 20)
    count = check_sectors(client, bench)
    check(count["blocked"] >= 68, "of 72 sectors between walls only %s" % count)
    way = "auto-transmit mode" if mode == "transmit" and firmware == "new" else "polled mode"
    check(way in bench.processes[1].log(), "the head is not %s" % way)


def no_sonar(bench):
    """Without a sonar all is unknown, and says why."""
    bench.conf()
    client = bench.sonard().client()
    check(all_unknown(client), "not all unknown without a sonar")
    reason = client.call("blocked", azimuth_deg=0, distance_m=1)["reason"]
    check(reason == "no data from the sonar", "the reason is: %s" % reason)
    check_blocked(bench, client, 0, 1, "unknown")


FORGET_S = 4.0


def moving(bench):
    """A pile of 0.8 m crosses 5 m ahead, from the left, at 0.5 m/s; without its ghosts, which lie at the end of
    the range, where no beam passes through them."""
    bench.sim("--ghost", "0", scene=bench.write("crossing", "pile 5 -2 0.4 0 0.5\n"), truth=True)
    bench.conf(sonar={"sector": "315 45 deg"}, grid={"clear_for": "4 s", "forget": "%g s" % FORGET_S})
    client = bench.sonard().client()

    def seen():
        return {s["azimuth_deg"] for s in client.call("sectors", distance_m=0)["sectors"] if s["state"] == "blocked"}

    first = until(seen, "the pile to be seen")
    place = min(first, key=lambda azimuth: apart(azimuth, 340))
    until(lambda: place not in beams_hit(bench.truth()[-50:]), "the pile to leave %g degrees" % place)
    left = time.monotonic()
    until(lambda: place not in seen(), "%g degrees to be free again" % place, 60)
    took = time.monotonic() - left
    note("a pile's old place is free %.1f s after it left (forget = %g s)" % (took, FORGET_S))
    # Fading alone takes so long from the highest certainty; 0.5 s are for asking.
    check(took <= FORGET_S + 0.5, "it took %.1f s, forget is %g s" % (took, FORGET_S))
    check(seen(), "the pile is no longer seen at all")


def beams_hit(truth):
    """The sectors of 5 degrees whose beams touch something."""
    return {round(ping["azimuth_deg"] / 5) % 72 * 5.0 for ping in truth if ping["range_m"] is not None}


class Autopilot(threading.Thread):
    """Tells the daemon the attitude, ten times a second, over a connection of its own."""

    def __init__(self, daemon):
        super().__init__(daemon=True)
        self.client = daemon.client()
        self.lock = threading.Lock()
        self.yaw_deg = 0.0
        self.ended = threading.Event()

    def tell(self, yaw_deg):
        with self.lock:
            self.yaw_deg = yaw_deg
            self.client.call("pose", attitude_deg=[0, 0, yaw_deg], depth_m=0)

    def run(self):
        while not self.ended.wait(0.1):
            self.tell(self.yaw_deg)

    def end(self):
        self.ended.set()
        self.join()


def turn_vehicle(sim, autopilot, yaw_deg):
    """Turns the vehicle while the sonar says nothing, so that no ping has the attitude of the other moment."""
    for silent_s in (0.6, 2, 6):
        sim.command("silent %g" % silent_s)
        begin = time.monotonic()
        time.sleep(0.3)
        autopilot.tell(yaw_deg)
        sim.command("pose 0 0 0 %g" % yaw_deg)
        autopilot.tell(yaw_deg)
        if time.monotonic() - begin < silent_s - 0.1:
            return
    raise Failed("this machine is too slow to turn the vehicle")


def attitude(bench):
    """The vehicle turns by 90 degrees: what was seen stays where it is in the world."""
    sim = bench.sim(truth=True)
    bench.conf(pose={"max_age": "0.8 s"}, vehicle={"station_keeping": "0 m/s"})
    daemon = bench.sonard()
    client = daemon.client()
    autopilot = Autopilot(daemon)
    autopilot.tell(0)
    autopilot.start()
    try:
        pings_until(client, TURN + 20)
        check_sectors(client, bench, ned=True)
        turn_vehicle(sim, autopilot, 90)
        pings_until(client, 5)
        check_sectors(client, bench, ned=True)
        check_wall(client, "body", 270, 9)
        pings_until(client, TURN + 20)
        check_sectors(client, bench, ned=True)
        check_wall(client, "ned", 0, 9)
        check_wall(client, "body", 0, 4)
        check_wall(client, "body", 270, 9)
    finally:
        autopilot.end()
    stopped = time.monotonic()
    until(lambda: all_unknown(client), "the pose to be too old")
    note("unknown %.2f s after the last pose (max_age = 0.8 s)" % (time.monotonic() - stopped))
    lost = client.call("blocked", azimuth_deg=0, distance_m=1)
    check(lost["reason"].startswith("the pose is too old: the attitude from a client is "), "the reason is: %s" % lost["reason"])
    check(client.call("status")["data"] == "the pose is too old", "status does not say so")
    autopilot.tell(90)
    check_wall(client, "ned", 0, 9)


cases = [("moving", moving), ("attitude", attitude), ("no_sonar", no_sonar),
         ("box_threads2_transmit_new", lambda bench: box(bench, 2, "transmit", "new")),
         ("box_threads0_request_old", lambda bench: box(bench, 0, "request", "old"))]

run(cases, parallel=6, gate=("no_sonar",))
