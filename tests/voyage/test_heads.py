#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Echo lists, Imagenex and Micron end to end, in a basin from 6 m behind to 9 m ahead and from 5 m left to 4 m right, and an
echosounder that looks ahead."""
from voyage import Voyage

from lib import check, run

TURN = 200       # pings of a full circle at 1.8 degrees
STEPS_M = 2 * 0.0625  # free water is told in steps of so much, and may end one earlier in a wide tile
PLATEAU_M = 0.5  # 4-bit echoes of a wall end at the top of their window: the peak may be anywhere on it
WALLS = ((0, 9), (90, 4), (180, 6), (270, 5))


def blocked(client, azimuth_deg, distance_m, **params):
    return client.call("blocked", azimuth_deg=azimuth_deg, distance_m=distance_m, **params)["state"]


def check_wall(client, azimuth_deg, wall_m, tolerance_m):
    sector = client.call("sectors", distance_m=0)["sectors"][azimuth_deg // 5]
    check(sector["state"] == "blocked" and abs(sector["range_m"] - wall_m) <= tolerance_m,
          "%d degrees: %s, the wall is at %g m" % (azimuth_deg, sector, wall_m))
    check(sector["free_to_m"] <= wall_m + 0.05, "%d degrees: free beyond the wall at %g m: %s" % (azimuth_deg, wall_m, sector))


# ---- echo lists ----

def echolist(bench, *arguments, **keys):
    bench.conf(sonar=dict({"device": "echolist", "range": "20 m"}, **keys))
    return Voyage(bench, "echolist_sim", "--from", "-90", "--to", "90", *arguments)


def case_echolist_walls(bench):
    trip = echolist(bench)
    trip.pings(130)
    client = trip.client()
    for azimuth_deg, wall_m in ((0, 9), (90, 4), (270, 5)):
        check_wall(client, azimuth_deg, wall_m, 0.2)
    sensor = client.sensor()
    check(sensor["state"] == "running" and sensor["what"] == "echo list" and sensor["pings"] == 130, str(sensor))
    check(sensor["garbage_bytes"] == 0 and sensor["bad_frame"] == 0, str(sensor))
    check(blocked(client, 180, 3) == "unknown", "it never looked aft")
    answer = client.call("blocked", azimuth_deg=0, distance_m=3)
    check((answer["target"], answer["bottom_db"]) == ("what the sonar reports", None), str(answer))


def case_echolist_tilt(bench):
    """A sonar that says it looks 40 degrees up has seen nothing of what is level."""
    trip = echolist(bench, "--tilt", "40", aperture="6.5 6.5 deg")
    trip.pings(130)
    client = trip.client()
    for azimuth_deg in range(0, 360, 15):
        check(blocked(client, azimuth_deg, 20) == "unknown", "level at %g degrees" % azimuth_deg)
    check(blocked(client, 0, 20, elevation_deg=40) == "blocked", "40 degrees up")


# ---- Imagenex ----

def imagenex(bench, model, **keys):
    scan = {"step": "2.4 deg"} if model == "881a" else {}
    bench.conf(sonar=dict({"device": "imagenex" + model, "range": "10 m"}, **scan, **keys))
    return Voyage(bench, "imagenex_sim", "--model", model)


def case_imagenex_fixed(bench):
    trip = imagenex(bench, "852")
    trip.pings(20)
    client = trip.client()
    check_wall(client, 0, 9, 0.15)
    sensor = client.sensor()
    check(sensor["what"] == "Imagenex 852 head 0x11", sensor["what"])
    check(sensor["state"] == "running" and sensor["range_m"] == 10 and sensor["pings"] == 20, str(sensor))
    check(sensor["garbage_bytes"] == sensor["bad_frame"] == sensor["timeouts"] == 0, str(sensor))
    for azimuth_deg in range(15, 346, 15):
        check(blocked(client, azimuth_deg, 2) == "unknown", "it looks ahead only, not to %d" % azimuth_deg)


def case_imagenex_full_circle(bench):
    trip = imagenex(bench, "881a")
    trip.pings(170)
    client = trip.client()
    for azimuth_deg, wall_m in WALLS:
        check_wall(client, azimuth_deg, wall_m, 0.15)


def case_imagenex_sector(bench):
    trip = imagenex(bench, "881a", sector="60 120 deg")
    trip.pings(60)
    client = trip.client()
    check_wall(client, 90, 4, 0.15)
    for azimuth_deg in list(range(0, 50, 10)) + list(range(140, 360, 10)):
        check(blocked(client, azimuth_deg, 2) == "unknown", "%d is outside the sector" % azimuth_deg)


# ---- Micron ----

def micron(bench, *arguments, **keys):
    bench.conf(sonar=dict({"device": "micron", "step": "1.8 deg"}, **keys))
    return Voyage(bench, "micron_sim", "--scene", "box", "--centring", "1", "--ms-per-gradian", "1", "--processing-ms", "1",
                  *arguments, truth=True)


def check_walls(client, tolerance_m=0.15, before="clear"):
    for azimuth_deg, wall_m in WALLS:
        check_wall(client, azimuth_deg, wall_m, tolerance_m)
        check(blocked(client, azimuth_deg, 0.8 * wall_m) in (before, "clear"), "not %s before the wall at %g" % (before, azimuth_deg))
        check(blocked(client, azimuth_deg, wall_m + 0.5) == "blocked", "not blocked behind the wall at %g" % azimuth_deg)


def micron_box(bench, kind, *arguments):
    trip = micron(bench, *arguments)
    trip.pings(TURN + 20)
    client = trip.client()
    count = [sector["state"] for sector in client.call("sectors", distance_m=0)["sectors"]].count("blocked")
    check(count == 72, "of 72 sectors between walls only %d blocked" % count)
    check_walls(client)
    check(client.sensor()["what"] == kind + " sw 6 serial 1234", "it is called %s" % client.sensor()["what"])


def case_micron_box(bench):
    micron_box(bench, "Micron DST")


def case_micron_box_plain_head(bench):
    micron_box(bench, "SeaNet head", "--plain")


def case_micron_sector(bench):
    """45 degrees to either side: everything else stays unknown."""
    trip = micron(bench, sector="315 45 deg")
    trip.pings(110)
    client = trip.client()
    states = [s["state"] for s in client.call("sectors", distance_m=0)["sectors"]]
    check(all(states[i] == "blocked" for i in range(-8, 9)), "ahead: %s" % states)
    check(all(state == "unknown" for state in states[11:62]), "astern: %s" % states)
    angles = [ping["azimuth_deg"] for ping in bench.truth()]
    check(all(a <= 46 or a >= 314 for a in angles), "the head left its sector")


def case_micron_echoes_of_4_bits_in_packets(bench):
    trip = micron(bench)
    trip.sonar("nibbles 1")
    trip.sonar("packets 1")
    trip.pings(2 * TURN + 20)  # the baseline is of 8 bits at first
    client = trip.client()
    check_walls(client, PLATEAU_M, before="unknown")  # a step of the counts may be as loud as the target
    check(client.sensor()["bad_frame"] == 0, "frames were refused: %s" % client.sensor())


def case_micron_range_changes(bench):
    """The head listens farther, then less far than it was told: the answers follow its replies."""
    trip = micron(bench)
    trip.pings(20)
    trip.sonar("range 15")
    trip.pings(TURN + 40)  # the baseline of the new range is known after 16
    trip.sonar("range 5")
    trip.pings(3)
    client = trip.client()
    check(abs(client.sensor()["range_m"] - 5) < 0.2, "told 5 m: %s" % client.sensor())
    check_walls(client)


# ---- Ping1D and Ping2 ----

def ping1d(bench, *arguments, pings=60, **keys):
    """An echosounder that chooses 8 m."""
    bench.conf(sonar=dict({"device": "ping1d", "range": "20 m"}, **keys))
    trip = Voyage(bench, "ping1d_sim", "--distance", "8", *arguments)
    trip.pings(pings)
    return trip


def ask(trip, *distances_m):
    """How far it is free ahead, in m, and the states to these distances."""
    daemon = trip.daemon()
    client = daemon.client()
    sector = client.call("sectors", distance_m=0)["sectors"][0]
    states = [blocked(client, 0, distance_m, half_angle_deg=2) for distance_m in distances_m]
    client.close()
    daemon.stop()
    return sector["free_to_m"] or 0, states


WAYS = (("--confidence", "100"), ("--ping2", "1"))  # what changes nothing
MODES = ({}, {"mode": "request"}, {"gain": "3"})


def case_ping1d_honest(bench):
    """What its profile shows to be free is free up to the chosen echo; one that is clearly weaker is nothing."""
    for keys in MODES:
        for side in ("0", "110"):
            free_m, states = ask(ping1d(bench, "--echo", "3", "--echo-counts", side, **keys), 9)
            check(7.9 - STEPS_M < free_m <= 8 and states == ["blocked"], "%s, %s counts at 3 m: free to %g m, %s" % (keys, side, free_m, states))


def case_ping1d_chooses_beyond_an_echo(bench):
    for way in WAYS:
        for keys in MODES:
            for pings in (2, 100):
                free_m, states = ask(ping1d(bench, "--echo", "3", *way, pings=pings, **keys), 3.3, 4, 7.9)
                told = "%s %s, %d pings: free to %g m, %s" % (way, keys, pings, free_m, states)
                check(2.8 < free_m <= 3 and "clear" not in states, told)
                check(pings == 2 or states == ["blocked"] * 3, told)


def case_ping1d_chooses_without_an_echo(bench):
    """Nothing is free, and what it reports blocks."""
    for way in WAYS:
        for also in ((), ("--echo", "3")):
            free_m, states = ask(ping1d(bench, "--bottom", "0", *also, *way), 1, 2.5, 7.9, 8.5)
            told = "%s %s: free to %g m, %s" % (way, also, free_m, states)
            check(free_m == 0 and "clear" not in states and states[3] == "blocked", told)
            check(not also or states[2] == "blocked", "the echo at 3 m: " + told)


def case_ping1d_reads_something_too_near(bench):
    """0.2 m read as 0.7 m."""
    for keys in MODES:
        free_m, states = ask(ping1d(bench, "--distance", "0.7", **keys), 0.6, 0.8)
        check(free_m == 0 and states == ["unknown", "blocked"], "%s: free to %g m, %s" % (keys, free_m, states))


def case_ping1d_profiles_show_an_echo_later(bench):
    """The water that a choice has freed ends there."""
    trip = ping1d(bench)
    trip.sonar("echo 3")
    trip.pings(20)
    check(ask(trip, 5)[1] == ["blocked"], "behind an echo of the profile")


def case_ping1d_without_profiles(bench):
    """Its distances cannot be checked, and it says so."""
    trip = ping1d(bench, "--without-profiles", "1", mode="request")
    check("cannot be checked" in trip.log(), trip.log())
    free_m, states = ask(trip, 9)
    check(7.9 - STEPS_M < free_m <= 8 and states == ["blocked"], "free to %g m, %s" % (free_m, states))


run([(name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")])
