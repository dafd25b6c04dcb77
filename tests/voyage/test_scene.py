#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""What sonard answers about a scene against what the virtual sonar knows is there: every way to run a Ping360, all threads."""
from voyage import ping360

from lib import check, run
from scene_truth import TURN, all_unknown, check_blocked, check_sectors, check_wall, compare


def sail(bench, mode, firmware, scene):
    bench.conf(sonar={"mode": mode})
    trip = ping360(bench, "--firmware", firmware, scene=scene, truth=True)
    trip.pings(TURN + 20)
    way = "auto-transmit mode" if mode == "transmit" and firmware == "new" else "polled mode"
    check(way in trip.log(), "the head is not %s: %s" % (way, trip.log()))
    return trip


def of_any_threads(bench, trip, check_answers):
    """The answers are right, and the same with any number of threads."""
    told = []
    for threads in ("0", "1", "2"):
        daemon = trip.daemon("--threads", threads)
        client = daemon.client()
        check_answers(client)
        told.append([client.call("sectors", distance_m=distance_m) for distance_m in (0, 3, 8)])
        client.close()
        daemon.stop()
    check(told[0] == told[1] == told[2], "threads change the answers")


def box(bench, mode, firmware):
    """A basin from 6 m behind to 9 m ahead and from 5 m left to 4 m right."""
    def answers(client):
        count = check_sectors(client, bench)
        check(count["blocked"] == 72, "of 72 sectors between walls only %s" % count)
        for azimuth_deg, wall_m in ((0, 9), (90, 4), (180, 6), (270, 5)):
            check_blocked(bench, client, azimuth_deg, 0.8 * wall_m, "clear")
            check_blocked(bench, client, azimuth_deg, wall_m + 0.5, "blocked")
    of_any_threads(bench, sail(bench, mode, firmware, "box"), answers)


def pile(bench, mode, firmware):
    """A pile of 0.8 m at 18.4 degrees, its near side at 5.92 m; nothing else."""
    def answers(client):
        count = check_sectors(client, bench)
        check(count["clear"] >= 66, "of 72 sectors in open water with a pile only %s" % count)
        check_blocked(bench, client, 18.4, 5, "clear")
        check_blocked(bench, client, 18.4, 7, "blocked")
        check_blocked(bench, client, 120, 9, "clear")
        check_blocked(bench, client, 120, 15, "unknown")
    of_any_threads(bench, sail(bench, mode, firmware, "pile"), answers)


def crossing(bench):
    """A pile of 0.8 m crosses 5 m ahead, from the left, at 0.5 m/s: what it has left is free again once that has faded."""
    bench.conf(sonar={"sector": "315 45 deg"}, grid={"clear_for": "4 s", "forget": "4 s"})
    trip = ping360(bench, "--ghost", "0", scene=bench.write("crossing", "pile 5 -2 0.4 0 0.5\n"))
    trip.run(11)  # the pile has come from 22 degrees to the left to 35 to the right; 5 s ago it was at 11
    client = trip.client()
    check_blocked(bench, client, 35, 8, "blocked")
    for sector in client.call("sectors", distance_m=0)["sectors"]:
        check(sector["state"] != "blocked" or 10 < sector["azimuth_deg"] < 50, "the pile has left: %s" % sector)
    ahead = client.call("blocked", azimuth_deg=0, distance_m=8, half_angle_deg=1)
    check(ahead["state"] == "clear", "the pile was ahead 7 s ago: %s" % ahead)


def ring_down(bench):
    """The learned ring-down ends a bin later from about 12 s on. That bin grows old, and not the water behind it."""
    clear_for_s, sweep_s = 4.0, 2.4
    bench.conf(sonar={"sector": "326 22 deg", "step": "0.9 deg"}, grid={"clear_for": "%g s" % clear_for_s, "forget": "%g s" % clear_for_s})
    trip = ping360(bench, "--ghost", "0", scene=bench.write("beside", "pile 5 -2 0.4 0 0.5\n"))
    trip.run(16)
    at = trip.moments()
    begins = set()
    # The pile has left this direction. Between beams of 2 degrees, 0.9 apart, their sides count. At the edge of the row
    # free space begins a bin later, where the ring-down ends alike in all of these sweeps.
    for half_s in range(12, 32):
        told = at(half_s / 2).call("explain", azimuth_deg=329, distance_m=7, half_angle_deg=0.5)
        answer = told["answer"]
        check(answer["state"] == "clear" and answer["age_s"] < sweep_s, "at %g s: %s" % (half_s / 2, answer))
        begins.update(p["blind_to_m"] for p in told["pings"]["newest"])
    check(len(begins) > 1, "the ring-down always ends at %s m" % begins)


def sits(trip, yaw_deg, seconds):
    """The vehicle lies there with that heading, and says so ten times a second."""
    for _ in range(round(seconds * 10)):
        trip.place(0, 0, 0, yaw_deg)
        trip.run(0.1)


def attitude(bench):
    """The vehicle turns by 90 degrees: what was seen stays where it is in the world, for as long as the attitude is known."""
    bench.conf(pose={"max_age": "0.8 s"}, vehicle={"station_keeping": "0 m/s"})
    trip = ping360(bench, truth=True)
    sits(trip, 0, 5)
    trip.sonar("silent 0.6")  # no ping has the attitude of the other moment
    sits(trip, 0, 0.3)
    turned_s = trip.now_s
    sits(trip, 90, 0.5)
    seen_s = trip.now_s
    sits(trip, 90, 5)
    trip.place(0, 0, 0, 90)
    lost_s = trip.now_s
    trip.run(1)
    trip.place(0, 0, 0, 90)
    trip.run(0.1)
    at = trip.moments()
    truth = bench.truth()

    def checked(moment_s, walls):
        client = at(moment_s)
        so_far = [ping for ping in truth if ping["t_ns"] * 1e-9 - truth[0]["t_ns"] * 1e-9 <= moment_s]
        faults, _ = compare(client.call("sectors", frame="ned", distance_m=0)["sectors"], so_far, ned=True)
        check(not faults, "at %g s: %s" % (moment_s, "; ".join(faults)))
        for frame, azimuth_deg, range_m in walls:
            check_wall(client, frame, azimuth_deg, range_m)
        return client
    checked(turned_s - 0.01, (("body", 0, 9), ("ned", 0, 9)))
    checked(turned_s + 0.2, (("body", 270, 9), ("ned", 0, 9), ("body", 0, 4)))
    checked(seen_s, (("body", 270, 9), ("ned", 0, 9), ("body", 0, 4)))
    checked(lost_s + 0.79, (("body", 270, 9), ("ned", 0, 9), ("body", 0, 4)))
    client = at(lost_s + 0.81)
    check(all_unknown(client), "the attitude is too old, and something is told")
    reason = client.call("blocked", azimuth_deg=0, distance_m=1)["reason"]
    check(reason.startswith("the pose is too old: the attitude from the capture is "), "the reason is: %s" % reason)
    check(client.call("status")["data"] == "the pose is too old", "status does not say so")
    check_wall(at(trip.now_s), "ned", 0, 9)


def clear_grows_old(bench):
    """What is clear stays so until the oldest beam that it rests on is as old as the limit, to the hundredth of a second. Then it
    rests on later beams that saw all of it as well, of which there are some in the time of a few; and on none, with the reason."""
    limit_s = 6.0
    bench.conf(grid={"clear_for": "%g s" % limit_s})
    trip = ping360(bench)
    trip.pings(TURN + 20)
    heard_s = trip.now_s
    trip.sonar("silent 60")
    trip.run(limit_s + 1)
    at = trip.moments()

    def asked(moment_s, azimuth_deg):
        return at(moment_s).call("blocked", azimuth_deg=azimuth_deg, distance_m=3, half_angle_deg=2)
    for azimuth_deg in range(0, 360, 45):
        moment_s, answer = heard_s, asked(heard_s, azimuth_deg)
        check(answer["state"] == "clear", "%g degrees: %s" % (azimuth_deg, answer))
        last_s = heard_s + limit_s - answer["age_s"] + 18 * heard_s / (TURN + 20)
        while answer["state"] == "clear":
            old_s = moment_s + limit_s - answer["age_s"]
            answer = asked(old_s - 0.01, azimuth_deg)
            check(answer["state"] == "clear", "%g degrees, too old too soon: %s" % (azimuth_deg, answer))
            moment_s = old_s + 0.01
            answer = asked(moment_s, azimuth_deg)
            check(moment_s < last_s, "%g degrees, no beam is so young: %s" % (azimuth_deg, answer))
        check(answer["state"] == "unknown" and answer["reason"].endswith("(limit %.1f s)" % limit_s), "%s" % answer)


def first_pings(bench):
    """Before the first ping all is unknown, and says why; where no ping went it stays so."""
    bench.conf()
    trip = ping360(bench)
    trip.pings(TURN)
    at = trip.moments()
    client = at(0)
    check(all_unknown(client), "not all unknown before the first ping")
    reason = client.call("blocked", azimuth_deg=0, distance_m=1)["reason"]
    check(reason == "no data from the sonar", "the reason is: %s" % reason)
    check_blocked(bench, client, 0, 1, "unknown")
    above = at(trip.now_s).call("blocked", azimuth_deg=0, elevation_deg=60, distance_m=1)
    check((above["state"], above["reason"]) == ("unknown", "never observed"), "above: %s" % above)


WAYS = (("transmit", "new"), ("request", "new"), ("transmit", "old"), ("request", "old"))

cases = [("scene_crossing", crossing), ("scene_ring_down", ring_down), ("scene_attitude", attitude),
         ("scene_clear_grows_old", clear_grows_old), ("scene_first_pings", first_pings)]
for scene in (box, pile):
    for way in WAYS:
        cases.append(("scene_%s_%s_%s" % (scene.__name__, *way), lambda bench, s=scene, w=way: s(bench, *w)))

run(cases)
