#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""test_nmea - heading and depth of a virtual NMEA 0183 instrument, over a pseudo-terminal and over UDP."""
import os
import socket
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from lib import BUILD, Process, check, free_port, run, until  # noqa: E402


class Instrument(Process):
    def __init__(self, bench):
        super().__init__(bench, "nmea_sim", [os.path.join(BUILD, "tests", "nmea_sim"), bench.path("nmea")],
                         stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        bench.processes.append(self)
        check(self.process.stdout.readline().startswith(b"ready "), "the instrument does not start: " + self.log())

    def command(self, text):
        self.process.stdin.write(text.encode() + b"\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().decode()
        check(answer.startswith("ok"), "%s: %s" % (text, answer))

    def stop(self):
        status = super().stop()
        self.process.stdin.close()
        self.process.stdout.close()
        return status


def start(bench, **keys):
    instrument = Instrument(bench)
    bench.conf(nmea=dict({"port": "serial:%s:4800" % bench.path("nmea")}, **keys))
    return instrument, bench.sonard().client()


def nmea(client):
    return client.call("status")["nmea"]


def has(client):
    return client.call("status")["pose"]["has"]


def heading(bench):
    instrument, client = start(bench)
    until(lambda: has(client) == ["attitude"], "an attitude")
    instrument.command("depth 5")
    before = nmea(client)["sentences"]
    until(lambda: nmea(client)["sentences"] > before + 10, "more sentences")
    check(has(client) == ["attitude"], "depth is used although it was not asked for")


def depth(bench):
    instrument, client = start(bench, use="depth")
    instrument.command("depth 5")
    until(lambda: has(client) == ["depth"], "a depth alone")


def magnetic(bench):
    instrument, client = start(bench)
    instrument.command("heading -1")
    instrument.command("magnetic 90")
    until(lambda: nmea(client)["no_variation"] > 3, "headings without variation")
    check(nmea(client)["age_s"] is None or nmea(client)["age_s"] > 0, "a magnetic heading was used")


def magnetic_with_variation(bench):
    instrument, client = start(bench, variation="2 deg")
    instrument.command("heading -1")
    instrument.command("magnetic 90")
    until(lambda: has(client) == ["attitude"], "an attitude")
    check(nmea(client)["no_variation"] == 0, "the variation is not used")


def attitude_wins(bench):
    """While a client gives whole attitudes the heading is not used, and is again when these have ended."""
    _, client = start(bench)
    until(lambda: has(client) == ["attitude"], "an attitude")
    for _ in range(20):
        client.call("pose", attitude_deg=[1, 2, 3])
    until(lambda: nmea(client)["heading_not_used"] > 0 or client.call("pose", attitude_deg=[1, 2, 3]) is None,
          "headings to be left out")
    before = nmea(client)["heading_not_used"]
    until(lambda: nmea(client)["age_s"] > 0.5, "the heading to rest")
    check(nmea(client)["heading_not_used"] > before, "left out and not counted")
    until(lambda: nmea(client)["age_s"] < 0.3, "the heading to be used again")


def faults(bench):
    instrument, client = start(bench)
    until(lambda: has(client) == ["attitude"], "an attitude")
    for fault, counter in (("corrupt 3", "bad_checksum"), ("bad_checksum 3", "bad_checksum"), ("garbage 300", None),
                           ("cut 2", None), ("drop 2", None), ("say PASHR,1,2,3", "other"),
                           ("say GPHDT,,T", "not_available"), ("say GPHDT,400.0,T", "bad_sentence")):
        before = nmea(client)
        instrument.command(fault)
        until(lambda: not counter or nmea(client)[counter] > before[counter], "%s to be counted" % fault)
        until(lambda: nmea(client)["values"] > before["values"] + 5, "values after %s" % fault)
    until(lambda: "bytes that are not valid NMEA 0183 messages" in bench.processes[-1].log(), "the garbage to be told")
    instrument.command("split")
    before = nmea(client)["values"]
    until(lambda: nmea(client)["values"] > before + 5, "values in single bytes")


def unplugged(bench):
    instrument, client = start(bench)
    until(lambda: has(client) == ["attitude"], "an attitude")
    instrument.command("unplug")
    until(lambda: nmea(client)["state"] == "no port", "the loss to be told")
    until(lambda: nmea(client)["age_s"] > 1.1, "the heading to be old")
    check(client.call("sectors")["pose_age_s"] > 1, "the pose is not old")
    instrument.command("plug")
    until(lambda: nmea(client)["age_s"] < 0.5, "the heading to be back")
    check(nmea(client)["reconnects"] == 1, "it was not counted")


def over_udp(bench):
    """Several sentences in a datagram, and one in two of them. The sender's own port is not the one in the configuration."""
    local = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        bench.conf(nmea={"port": "udp:127.0.0.1:%d:%d" % (local, local), "use": "both"})
        client = bench.sonard().client()
        until(lambda: nmea(client)["state"] == "open", "the port")
        for part in (b"$GPHDT,274.07,T*03\r\n$INDPT,2.3,0.0*46\r\n$GPH", b"DT,274.07,T*03\r\n"):
            ours.sendto(part, ("127.0.0.1", local))
        until(lambda: nmea(client)["values"] == 3, "three values")
        check(sorted(has(client)) == ["attitude", "depth"], "the pose has %s" % has(client))


def listening(bench):
    """The sender has any port of its own; another host is counted and named once."""
    local = free_port()
    bench.conf(nmea={"port": "udp:127.0.0.1:%d:listen" % local})
    client = bench.sonard().client()
    until(lambda: nmea(client)["state"] == "open", "the port")
    for _ in range(2):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
            ours.sendto(b"$GPHDT,274.07,T*03\r\n", ("127.0.0.1", local))
    until(lambda: nmea(client)["values"] == 2, "two values")
    check(nmea(client)["strangers"] == 0, "a friend is a stranger")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.2", 0))
        for _ in range(2):
            other.sendto(b"$GPHDT,1.0,T*30\r\n", ("127.0.0.1", local))
    until(lambda: nmea(client)["strangers"] == 2, "two strangers")
    check(nmea(client)["values"] == 2, "a stranger was heard")
    check(bench.processes[-1].log().count("dropping datagrams of 127.0.0.2") == 1, "not named once")


def not_used(bench):
    """Sentences that come and give nothing are counted with the reason, which is logged once."""
    local = free_port()
    bench.conf(nmea={"port": "udp:127.0.0.1:%d:listen" % local})
    client = bench.sonard().client()
    until(lambda: nmea(client)["state"] == "open", "the port")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        def said():
            ours.sendto(b"$GPHDT,274.07,T\r\n", ("127.0.0.1", local))
            return "without checksum (set checksum = optional)" in nmea(client)["unused"]
        until(said, "the reason")
        for _ in range(3):
            said()
        ours.sendto(b"$GPHDT,274.07,T*03\r\n", ("127.0.0.1", local))
    until(lambda: nmea(client)["values"] == 1, "a value")
    check(nmea(client)["unused"] == "", "it is still said")
    check(bench.processes[-1].log().count("none used: ") == 1, "not logged once")


def echosounder(bench):
    """Depths of a sounder block where the bottom is and clear the water before it; one without a depth takes that back."""
    instrument = Instrument(bench)
    instrument.command("heading -1")
    bench.conf(sonar={"device": "nmea0183", "port": "serial:%s:4800" % bench.path("nmea"), "range": "20 m",
                      "rotation": "0 -90 0 deg"}, grid={"elevation": "full"})
    client = bench.sonard().client()

    def down(distance_m):
        return client.call("blocked", azimuth_deg=0, elevation_deg=-90, distance_m=distance_m, half_angle_deg=1)

    instrument.command("depth 5")
    until(lambda: down(5.5)["state"] == "blocked", "the bottom")
    check(abs(down(5.5)["range_m"] - 5) < 0.3, "the bottom is at 5 m: %s" % down(5.5))
    until(lambda: down(4)["state"] == "clear", "free water over the bottom")
    check(down(0.4)["state"] == "clear", "clear to 4 m is clear to 0.4 m, which `near` promises: %s" % down(0.4))
    instrument.command("depth -1")
    instrument.command("say SDDPT,,0.0")
    until(lambda: down(4)["state"] == "unknown", "the free water to be taken back")


def echosounder_over_udp(bench):
    """As over_udp; a sonar that sends nothing cannot be answered either."""
    local = free_port()
    bench.conf(sonar={"device": "nmea0183", "port": "udp:127.0.0.1:%d:%d" % (local, local), "rotation": "0 -90 0 deg"})
    client = bench.sonard().client()

    def sonar():
        return client.call("status")["sensors"][0]

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        def pinged():
            ours.sendto(b"$SDDPT,7.25,0.50,100.0*51\r\n", ("127.0.0.1", local))
            return sonar()["pings"] > 0
        until(pinged, "a ping")
    check(sonar()["state"] == "running", "%s" % sonar())


cases = [(f.__name__, f) for f in (heading, depth, magnetic, magnetic_with_variation, attitude_wins, faults, unplugged,
                                         over_udp, listening, not_used, echosounder,
                                   echosounder_over_udp)]
run(cases, parallel=4, gate=("over_udp", "listening", "not_used", "echosounder", "echosounder_over_udp"))
