#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Sonars of the Ping protocol over UDP and serial lines: Ping360 behind a bridge, Ping1D, Surveyor, several at once."""
import socket
import struct
import time

from lib import SONARCTL, check, free_port, note, run, until

ASK_IDENTITY = bytes.fromhex("42520200060000000400a000")

SONARS = {
    "head": {"device": "ping360", "range": "10 m", "step": "1.8 deg"},
    "sounder": {"device": "ping1d", "range": "20 m", "rotation": "0 -90 0 deg"},
    "swath": {"device": "surveyor", "range": "20 m", "rotation": "0 -90 0 deg"},
}


def start(bench, sonars, sound_speed=1500, **extra):
    """sonard with the sonars given as name=port; the client."""
    text = "[water]\nsound_speed = %g m/s\n" % sound_speed
    text += "[server]\nsocket = %s\n[extract]\nno_echo = heard\n[log]\nlevel = debug\n" % bench.socket_path
    for name, port in sonars.items():
        keys = dict(SONARS[name], port=port, **extra.get(name, {}))
        text += "[sonar %s]\n" % name + "".join("%s = %s\n" % item for item in keys.items())
    daemon = bench.sonard(conf=bench.write("sonard.conf", text))
    return daemon, daemon.client()


def sensor(client, name):
    return next(s for s in client.call("status")["sensors"] if s["name"] == name)


def pings(client, name, count, limit_s=30):
    first = sensor(client, name)["pings"]
    until(lambda: sensor(client, name)["pings"] >= first + count, "%d pings of %s" % (count, name), limit_s)


def running(client, name, limit_s=20):
    until(lambda: sensor(client, name)["state"] == "running", "%s to run" % name, limit_s)


def ping360(bench, *arguments):
    return bench.twin("ping360_sim", "--ms-per-gradian", "1", "--processing-ms", "2", *arguments)


def down(client, distance_m, elevation_deg=-90, azimuth_deg=0):
    return client.call("blocked", azimuth_deg=azimuth_deg, elevation_deg=elevation_deg, distance_m=distance_m,
                       half_angle_deg=1)


def check_range(answer, wanted_m, tolerance_m=0.4):
    check(answer["state"] == "blocked", "%s, something is at %g m" % (answer, wanted_m))
    check(abs(answer["range_m"] - wanted_m) <= tolerance_m, "at %g m, it is at %g m" % (answer["range_m"], wanted_m))


def no_restart(client, name):
    s = sensor(client, name)
    check(s["restarts"] == 0 and s["state"] == "running", "%s: %s" % (name, s))


def network_head(bench):
    """A Ping360 on the network, its frames cut by datagrams anywhere."""
    sim = ping360(bench, "--udp", "0")
    daemon, client = start(bench, {"head": "udp:" + sim.address})
    pings(client, "head", 210)
    for azimuth_deg, wall_m in ((0, 9), (90, 4), (180, 6), (270, 5)):
        check_range(client.call("blocked", azimuth_deg=azimuth_deg, distance_m=wall_m + 0.5), wall_m)
    head = sensor(client, "head")
    check(head["garbage_bytes"] == 0 and head["bad_checksum"] == 0, "whole frames are refused: %s" % head)
    check("auto-transmit mode" in daemon.log(), "the head is not in auto-transmit mode")


def mirrored_head(bench):
    """The sector is the vehicle's, and what the head hears to port is to starboard: so the head scans its port side."""
    sim = ping360(bench, "--udp", "0")
    _, client = start(bench, {"head": "udp:" + sim.address}, head={"mirror": "yes", "sector": "30 120 deg"})
    pings(client, "head", 80)
    check_range(client.call("blocked", azimuth_deg=90, distance_m=5.5), 5)
    check(client.call("blocked", azimuth_deg=270, distance_m=3)["state"] == "unknown", "it has scanned the wrong side")


def bridge(bench):
    """Somebody else speaks to the bridge: the sonar's bytes come back within seconds and without a new start."""
    sim = ping360(bench, "--udp", "0")
    _, client = start(bench, {"head": "udp:" + sim.address})
    pings(client, "head", 20)
    host, port = sim.address.split(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(ASK_IDENTITY, (host, int(port)))
        begin = time.monotonic()
        pings(client, "head", 20)
    note("pings came back %.1f s after another host spoke to the bridge" % (time.monotonic() - begin))
    no_restart(client, "head")


def taken_over(bench):
    """Another program sets a narrow sector and 2 m: said once, counted, and set right; the pings in between are of 2 m."""
    sim = ping360(bench, "--udp", "0")
    daemon, client = start(bench, {"head": "udp:" + sim.address})
    pings(client, "head", 20)
    check(sensor(client, "head")["other_settings"] is None and client.call("status")["data"] == "ok", "from the start")
    payload = struct.pack("<BBHHHHHHBB", 1, 0, 11, 88, 750, 1200, 180, 220, 1, 0)
    frame = struct.pack("<2sHHBB", b"BR", len(payload), 2602, 0, 0) + payload
    host, port = sim.address.rsplit(":", 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(frame + struct.pack("<H", sum(frame) & 0xFFFF), (host, int(port)))
        until(lambda: sensor(client, "head")["taken_over"] == 1, "the takeover to be noticed", 60)
    until(lambda: sensor(client, "head")["other_settings"] is None, "our settings", 60)
    check(sensor(client, "head")["range_m"] > 9 and client.call("status")["data"] == "ok", str(client.call("status")["sensors"]))
    check(daemon.log().count("(another program?); sending them again: ") == 1 and "sample_period 88 (sent 445)" in daemon.log(), daemon.log())


def nobody_there(bench):
    """Nobody has the port at first: counted, said once, and found as soon as somebody has it."""
    port = free_port()
    daemon, client = start(bench, {"sounder": "udp:127.0.0.1:%d" % port})
    until(lambda: sensor(client, "sounder")["port_refused"] >= 4, "refusals to be counted")
    until(lambda: sensor(client, "sounder")["state"] == "silent", "the silence to be known")
    check(daemon.log().count("no answer from") == 1, "the silence is not said once")
    check("is the bridge running?" in daemon.log() and "baud" not in daemon.log(), daemon.log())
    table = bench.run(SONARCTL, "--socket", bench.socket_path, "status").stdout
    check("datagrams refused: nothing listens there" in table, table)
    check(sensor(client, "sounder")["reconnects"] == 0, "the port was opened again")
    bench.twin("ping1d_sim", "--udp", str(port))
    running(client, "sounder")


def echosounder(bench, udp):
    """The bottom is below, and nowhere else; an unsure reading is none."""
    where = ("--udp", "0") if udp else ("--link", bench.path("sounder"))
    sim = bench.twin("ping1d_sim", "--distance", "6", *where)
    port = "udp:" + sim.address if udp else "serial:%s:115200" % sim.address
    _, client = start(bench, {"sounder": port})
    pings(client, "sounder", 30)
    check_range(down(client, 8), 6)
    check(down(client, 4)["state"] == "clear", "not clear above the bottom: %s" % down(client, 4))
    check_range(down(client, 8, elevation_deg=-80), 6)
    for elevation_deg in (-60, 0, 90):
        answer = down(client, 3, elevation_deg)
        check((answer["state"], answer["reason"]) == ("unknown", "never observed"), "%g: %s" % (elevation_deg, answer))
    sim.command("distance 3")
    pings(client, "sounder", 30)
    check_range(down(client, 8), 3)
    sim.command("confidence 20")
    pings(client, "sounder", 10)
    check(down(client, 2.5)["state"] != "blocked", "an unsure reading counts: %s" % down(client, 2.5))
    no_restart(client, "sounder")
    check("Ping1D" in sensor(client, "sounder")["what"], "not identified")


def echosounder_without_power(bench, mode):
    """It comes back at its own settings, of them a speed of sound that makes the bottom deeper: it is set up anew."""
    sim = bench.twin("ping1d_sim", "--distance", "6", "--sound-speed", "1400", "--link", bench.path("sounder"))
    _, client = start(bench, {"sounder": "serial:%s:115200" % sim.address}, 1400, sounder={"mode": mode})
    pings(client, "sounder", 30)
    sim.command("reboot 1")
    until(lambda: sensor(client, "sounder")["restarts"] == 1, "the start to be noticed", 10)
    pings(client, "sounder", 30)
    check_range(down(client, 8), 6, 0.15)
    check(sensor(client, "sounder")["state"] == "running", "it does not run again")


def asked_echosounder(bench):
    """mode = request, in water that is not what the device thinks."""
    sim = bench.twin("ping1d_sim", "--udp", "0", "--distance", "10", "--sound-speed", "1500")
    _, client = start(bench, {"sounder": "udp:" + sim.address}, sounder={"mode": "request", "gain": "2"})
    pings(client, "sounder", 30)
    check_range(down(client, 12), 10)
    check(", 0 profiles," in sim.command("status"), "profiles are sent: " + sim.command("status"))


def multibeam(bench):
    """A bottom at 8 m and a wall 5 m to starboard, by a fan of 256 points that looks down."""
    sim = bench.twin("surveyor_sim", "--udp", "0")
    _, client = start(bench, {"swath": "udp:" + sim.address})
    pings(client, "swath", 60)
    check_range(down(client, 10), 8)
    check_range(down(client, 16, elevation_deg=-50, azimuth_deg=270), 8 / 0.766, 0.7)
    check_range(down(client, 10, elevation_deg=-40, azimuth_deg=90), 5 / 0.766, 0.7)
    check(down(client, 6)["state"] == "clear", "not clear above the bottom: %s" % down(client, 6))
    check(down(client, 3, elevation_deg=0)["state"] == "unknown", "ahead is known")
    swath = sensor(client, "swath")
    check(swath["garbage_bytes"] == 0 and swath["lost_frames"] == 0, "%s" % swath)
    sim.command("points 512")
    sim.command("yz-too 1")
    pings(client, "swath", 40)
    no_restart(client, "swath")
    check(sensor(client, "swath")["pings"] <= int(sim.command("status").split(" pings")[0].split()[-1]), "pings told twice")


def multibeam_clock(bench):
    """Pings are timed by the sonar's own counter, across its wrap and a start anew."""
    sim = bench.twin("surveyor_sim", "--udp", "0", "--clock-ppm", "100")
    _, client = start(bench, {"swath": "udp:" + sim.address})

    def clock():
        return sensor(client, "swath").get("clock", {"used": False})

    def fits():  # after a stall it is for a moment not used, and says no drift
        now = clock()
        return now["used"] and abs(now["drift_ppm"] + 100) < 400 and 0 <= now["jitter_s"] < 0.05

    until(lambda: clock()["used"], "the clock to be used", 90)
    pings(client, "swath", 120)
    until(lambda: clock()["used"], "the clock to be used still, or again after a stall", 90)
    check(clock()["restarts"] == 0, "the wrap is a restart: %s" % clock())
    until(fits, "the clock to fit", 60)
    sim.command("reboot 1")
    pings(client, "swath", 30)
    check(not clock()["used"], "times go across the start: %s" % clock())
    until(lambda: clock()["used"], "the clock to be used again", 90)


FAULTS = (("drop 3", "lost_frames", 3), ("corrupt 3", "bad_checksum", 3), ("short 2", "lost_frames", 2),
          ("garbage 5000", "garbage_bytes", 4000), ("twice 4", None, 0), ("swap 2", None, 0), ("split 1", None, 0),
          ("split 0", None, 0))


def faults(bench, program, name):
    """Every fault of the line costs its own frames and nothing else."""
    sim = bench.twin(program, "--udp", "0")
    _, client = start(bench, {name: "udp:" + sim.address})
    pings(client, name, 10)
    for command, counter, least in FAULTS:
        before = sensor(client, name)
        sim.command(command)
        pings(client, name, 15)
        after = sensor(client, name)
        if counter:
            grown = after[counter] - before[counter]
            check(grown >= least, "%s: %s grew by %d, not %d" % (command, counter, grown, least))
    no_restart(client, name)
    sim.command("silent 2")
    pings(client, name, 20)
    if name == "swath": # the echosounder may have lost its settings meanwhile, and is told them anew
        no_restart(client, name)
    sim.command("flood 0.5")
    pings(client, name, 20)
    sim.command("silent 12")
    until(lambda: sensor(client, name)["state"] == "silent", "the silence to be known", 30)
    running(client, name, 30)


def several(bench):
    """Three sonars of three kinds: each fails in its way, and the others do not notice."""
    head = bench.sim("--seed", "5")
    sounder = bench.twin("ping1d_sim", "--udp", "0")
    swath = bench.twin("surveyor_sim", "--udp", "0")
    _, client = start(bench, {"head": "serial:%s:4000000" % bench.port_path, "sounder": "udp:" + sounder.address,
                              "swath": "udp:" + swath.address})
    names = ("head", "sounder", "swath")
    for name in names:
        pings(client, name, 20)
    for broken, sim, fault, mend, state in (("head", head, "unplug", "plug", "no port"),
                                            ("sounder", sounder, "silent 3600", "silent 0", "silent"),
                                            ("swath", swath, "unplug", "plug", "silent")):
        before = {name: sensor(client, name) for name in names}
        sim.command(fault)
        until(lambda: sensor(client, broken)["state"] == state, "%s to be %s" % (broken, state), 30)
        for name in names:
            if name != broken:
                pings(client, name, 20)
                after = sensor(client, name)
                for counter in ("restarts", "timeouts", "reconnects", "bad_checksum", "dropped"):
                    check(after[counter] == before[name][counter], "%s of %s grew while %s was away" % (counter, name, broken))
        sim.command(mend)
        running(client, broken)
        pings(client, broken, 10)


cases = [("network_head", network_head), ("mirrored_head", mirrored_head), ("bridge", bridge), ("nobody_there", nobody_there),
         ("taken_over", taken_over),
         ("echosounder_udp", lambda bench: echosounder(bench, True)),
         ("echosounder_serial", lambda bench: echosounder(bench, False)),
         ("echosounder_without_power", lambda bench: echosounder_without_power(bench, "transmit")),
         ("asked_echosounder_without_power", lambda bench: echosounder_without_power(bench, "request")),
         ("asked_echosounder", asked_echosounder), ("multibeam", multibeam), ("multibeam_clock", multibeam_clock),
         ("faults_ping1d", lambda bench: faults(bench, "ping1d_sim", "sounder")),
         ("faults_surveyor", lambda bench: faults(bench, "surveyor_sim", "swath")),
         ("several", several)]

run(cases, parallel=4)
