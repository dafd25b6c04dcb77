#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""What sonard answers about a scene against what the virtual sonar knows is there."""
import time

from lib import check, note, pings_until, run, until
from scene_truth import TURN, all_unknown, apart, check_blocked, check_sectors


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


cases = [("moving", moving), ("no_sonar", no_sonar),
         ("box_threads2_transmit_new", lambda bench: box(bench, 2, "transmit", "new")),
         ("box_threads0_request_old", lambda bench: box(bench, 0, "request", "old"))]

run(cases, parallel=6, gate=("no_sonar",))
