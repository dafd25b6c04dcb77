#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Every fault of every wire, combined at random, for SECONDS (30): a virtual basin with four scanning heads on serial
lines, an echosounder and a multibeam over UDP, depth over Modbus, heading over NMEA 0183, a pose, a map that is saved,
and clients who come and go.

While it lasts no answer may call clear what the basin's walls and bottom block; when the faults of a round are over all
sonars come back, and from then on nothing is lost; the daemon lives, and its memory stays what it was.
SONARD_SEED repeats a run as far as the clock lets it."""
import json
import math
import os
import random
import socket
import signal
import time

from lib import SANITIZER, SEED, check, note, run, until

SECONDS = float(os.environ.get("SECONDS") or 30)
WALLS = ((-6.0, 9.0), (-5.0, 4.0))  # of the scene "box": north, east
BOTTOM_M = 6.0
SLACK_M = 0.5                       # within which an answer may err in range
NEVER_IN_CALM = ("bad_checksum", "bad_frame", "garbage_bytes", "lost_frames", "nacks", "restarts", "reconnects")

COUNTED = ("drop", "corrupt", "short", "garbage")
TIMED = ("silent", "stall", "flood")
TWICE = ("twice", "swap")

# Program and arguments of each wire's twin; its section; its faults: counted ones, those that last, those that are
# switched on and off again.
WIRES = {
    "head": ("ping360_sim", ("--ms-per-gradian", "1", "--processing-ms", "2"),
             {"device": "ping360", "range": "10 m", "step": "1.8 deg"},
             COUNTED + TWICE + ("nack",), TIMED,
             (("split on", "split off"), ("range 5", "range 0"), ("unplug", "plug"), ("reboot", None))),
    "micron": ("micron_sim", ("--centring", "1", "--ms-per-gradian", "1", "--processing-ms", "1"),
               {"device": "micron", "range": "10 m", "step": "1.8 deg"},
               COUNTED + ("motor",), TIMED,
               (("split 1", "split 0"), ("nibbles 1", "nibbles 0"), ("packets 1", "packets 0"),
                ("range 5", "range 0"), ("unplug", "plug"), ("reboot", None))),
    "imagenex": ("imagenex_sim", ("--model", "881a"),
                 {"device": "imagenex881a", "range": "10 m", "step": "2.4 deg"},
                 ("drop", "short", "garbage"), TIMED,  # its lines have no checksum: a wrong bit is no fault to it
                 (("split 1", "split 0"), ("unplug", "plug"))),
    "sweep": ("echolist_sim", ("--from", "-90", "--to", "90", "--range", "12"),
              {"device": "echolist", "range": "12 m"},
              COUNTED, TIMED, (("split 1", "split 0"), ("unplug", "plug"))),
    "sounder": ("ping1d_sim", ("--distance", "%g" % BOTTOM_M),
                {"device": "ping1d", "range": "20 m", "rotation": "0 -90 0 deg"},
                COUNTED + TWICE + ("refuse",), TIMED, (("split 1", "split 0"), ("unplug", "plug"), ("reboot 1", None))),
    "swath": ("surveyor_sim", ("--bottom", "%g" % BOTTOM_M, "--wall", "0"),
              {"device": "surveyor", "range": "20 m", "rotation": "0 -90 0 deg"},
              COUNTED + TWICE, TIMED, (("split 1", "split 0"), ("unplug", "plug"), ("reboot 1", None))),
}
UDP = ("sounder", "swath")
MODBUS = ("silent 5", "exception 5", "bad_crc 5", "wrong_slave 5", "garbage 5", "cut 5", "stray 3")


def wall_m(azimuth_deg):
    """From the vehicle to the basin's wall."""
    away = []
    for direction, (low, high) in zip((math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))), WALLS):
        if abs(direction) > 1e-9:
            away.append((high if direction > 0 else low) / direction)
    return min(away)


class Campaign:
    def __init__(self, bench, dice):
        self.bench, self.dice = bench, dice
        self.twins = {}
        self.pose_from = 0.0
        self.asked = {"clear": 0, "blocked": 0, "unknown": 0}
        self.sharp = 0  # answers that a wrong picture would have had wrong: clear just before the wall
        self.faults = 0

    def start(self):
        sections = {}
        for name, (program, arguments, keys, *_) in WIRES.items():
            where = ("--udp", "0") if name in UDP else ("--link", self.bench.path(name))
            twin = self.bench.twin(program, *where, *arguments)
            port = "udp:%s" % twin.address if name in UDP else "serial:%s:4000000" % self.bench.path(name)
            sections["sonar " + name] = dict(keys, port=port)
            self.twins[name] = twin
        self.depth = self.bench.twin("modbus_sim", "rtu", self.bench.path("depth"))
        self.compass = self.bench.twin("nmea_sim", self.bench.path("nmea"))
        self.compass.command("heading 0")
        sections["depth"] = {"source": "modbus-rtu:%s:9600" % self.bench.path("depth"), "timeout": "100 ms",
                             "turnaround": "400 ms"}
        sections["nmea"] = {"port": "serial:%s:4800" % self.bench.path("nmea")}
        sections.update({"server": {"socket": self.bench.socket_path}, "extract": {"no_echo": "heard"},
                         "pipeline": {"threads": self.dice.randrange(3)}, "log": {"level": "notice"},
                         "map": {"voxel": "0.2 m", "memory": "8 MiB", "directory": self.bench.path("maps")}})
        text = "".join("[%s]\n%s" % (section, "".join("%s = %s\n" % item for item in keys.items()))
                       for section, keys in sections.items())
        self.daemon = self.bench.sonard(conf=self.bench.write("sonard.conf", text))
        self.client = self.daemon.client()

    # ---- what must hold at any time ----

    def ask(self):
        """One question about what is blocked in truth; the pose goes along."""
        check(self.daemon.status is None, "sonard ended with %s: %s" % (self.daemon.status, self.daemon.log()[-2000:]))
        if time.monotonic() >= self.pose_from:
            self.client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 10])
        if self.dice.randrange(8) == 0:
            where, truth_m = {"azimuth_deg": 0, "elevation_deg": -90}, BOTTOM_M
        else:
            where = {"azimuth_deg": self.dice.uniform(0, 360)}
            truth_m = wall_m(where["azimuth_deg"])
        answer = self.client.call("blocked", distance_m=truth_m + SLACK_M, half_angle_deg=1, **where)
        self.asked[answer["state"]] += 1
        check(answer["state"] != "clear", "seed %d: %s is blocked at %.2f m, and called %s, from %s"
              % (SEED, where, truth_m, answer, self.client.call("explain", distance_m=truth_m + SLACK_M, half_angle_deg=1, **where)))
        before = self.client.call("blocked", distance_m=max(0.8, truth_m - 2 * SLACK_M), half_angle_deg=1, **where)
        self.sharp += before["state"] == "clear"

    def watch(self, span_s):
        end = time.monotonic() + span_s
        while time.monotonic() < end:
            self.ask()
            time.sleep(0.01)

    def sensors(self):
        return {sensor["name"]: sensor for sensor in self.client.call("status")["sensors"]}

    def running(self):
        self.ask()
        return all(sensor["state"] == "running" for sensor in self.sensors().values())

    # ---- faults ----

    def wire_fault(self, name):
        """Does one; returns how long it lasts, and the command that ends it (None: nothing to do)."""
        counted, timed, switched = WIRES[name][3:]
        what = self.dice.choice(counted + timed + switched)
        if isinstance(what, tuple):
            self.twins[name].command(what[0])
            return what[0], 0, what[1]
        number = self.dice.randrange(1, 2000 if what == "garbage" else 7) if what in counted else self.dice.uniform(0.2, 2)
        text = "%s %g" % (what, number)
        self.twins[name].command(text)
        return text, number if what in timed else 0, None

    def other_fault(self):
        what = self.dice.choice(("modbus", "modbus unplug", "nmea", "pose", "client", "reload", "save",
                                 "visitor"))
        if what == "modbus":
            what = self.dice.choice(MODBUS)
            self.depth.command(what)
        elif what == "modbus unplug":
            self.depth.command("unplug")
            return what, 0, lambda: self.depth.command("plug")
        elif what == "nmea":
            what = self.dice.choice(("drop 5", "corrupt 5", "cut 5", "garbage 100"))
            self.compass.command(what)
        elif what == "pose":
            self.pose_from = time.monotonic() + 2
        elif what == "reload":
            self.daemon.process.send_signal(signal.SIGHUP)
        elif what == "save": # refused while another is at work
            self.client.send(json.dumps({"jsonrpc": "2.0", "id": 1, "method": "map_save",
                                         "params": {"name": "map%d" % self.dice.randrange(4)}}).encode() + b"\n")
            check(self.client.reply()["id"] == 1, "map_save was not answered")
        elif what == "visitor": # leaves in the middle of what it asked for
            visitor = self.daemon.client()
            visitor.call("version")
            for method, params in (("image", {}), ("clusters", {}), ("watch", {"method": "sectors", "rate_hz": 20})):
                visitor.send(json.dumps({"jsonrpc": "2.0", "id": 2, "method": method, "params": params}).encode() + b"\n")
            visitor.close()
        else:
            with socket.socket(socket.AF_UNIX) as rude:
                rude.connect(self.bench.socket_path)
                rude.setblocking(False)
                try:
                    rude.send(self.dice.choice((b"[" * 5000, b"\xff" * 70000, b'{"jsonrpc":"2.0",', b"\n" * 1000)))
                except OSError:
                    pass
        return what, 0, None

    def round(self):
        """Some wires have some faults at once; then all is well again."""
        told, ends, lasts = [], [], 0
        for name in self.dice.sample(sorted(WIRES), self.dice.randint(1, len(WIRES))):
            for _ in range(self.dice.randint(1, 2)):
                text, seconds, end = self.wire_fault(name)
                told.append("%s %s" % (name, text))
                lasts = max(lasts, seconds)
                if end:
                    ends.append((self.twins[name], end))
                if end == "plug":
                    break  # without a wire there are no other faults
        for _ in range(self.dice.randint(0, 2)):
            text, _, end = self.other_fault()
            told.append(text)
            if end:
                ends.append((None, end))
        self.faults += len(told)
        self.watch(max(lasts, self.dice.uniform(0.2, 1)))
        for twin, end in ends:
            if twin:
                twin.command(end)
            else:
                end()
        until(self.running, "seed %d: all sonars to run after %s: %s" % (SEED, told, {
            name: sensor["state"] for name, sensor in self.sensors().items()}), 45)
        return told

    def spell(self):
        """What is lost within a second although nothing is wrong, and how many pings come."""
        before = self.sensors()
        self.watch(1)
        after = self.sensors()
        lost = ["%s %s: %d" % (name, key, after[name][key] - before[name][key]) for name in after
                for key in NEVER_IN_CALM if after[name].get(key, 0) > before[name].get(key, 0)]
        return lost, sum(after[name]["pings"] - before[name]["pings"] for name in after)

    def calm(self, told):
        """The last of the faults that were ordered come with the next frames; then nothing is lost. Returns the pings."""
        spells = []
        while not spells or spells[-1][0]:
            spells.append(self.spell())
            check(len(spells) <= 20, "seed %d: pings are lost for no reason after %s: %s" % (SEED, told, spells))
        return spells[-1][1]


def memory_kib(pid):
    with open("/proc/%d/status" % pid, encoding="ascii") as f:
        return int([line for line in f if line.startswith("VmRSS")][0].split()[1])


def campaign(bench):
    dice = random.Random(SEED)
    c = Campaign(bench, dice)
    c.start()
    until(c.running, "all sonars to run", 45)
    c.watch(3)
    begun = time.monotonic()
    rounds, pings, memory = 0, 0, None
    while time.monotonic() < begun + SECONDS or rounds < 3:
        told = c.round()
        came = c.calm(told)
        check(came > 0, "seed %d: no ping although all sonars run, after %s" % (SEED, told))
        pings += came
        rounds += 1
        if memory is None and time.monotonic() > begun + SECONDS / 3:
            memory = memory_kib(c.daemon.pid)
    used = c.client.call("map")["used_bytes"] // 1024  # of the map, touched for the first time, and the copy that is saved
    grown = memory_kib(c.daemon.pid) - (memory or memory_kib(c.daemon.pid))
    note("seed %d: %d rounds, %d faults survived; %d answers about what is blocked: %s; %d clear up to a wall; %d pings in "
         "calm, none lost; memory grew by %d KiB, the map has %d KiB"
         % (SEED, rounds, c.faults, sum(c.asked.values()), c.asked, c.sharp, pings, grown, used))
    check(c.sharp > 0 and c.asked["blocked"] > 0, "nothing was ever known: this campaign shows nothing")
    check(c.daemon.status is None, "sonard ended")
    check(SANITIZER or grown < 1024 + 2 * used, "seed %d: memory grew by %d KiB, the map has %d" % (SEED, grown, used))


run([("campaign", campaign)])
