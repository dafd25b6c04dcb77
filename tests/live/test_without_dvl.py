#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""A stock BlueROV2 as docs/without-a-dvl.md sets it up: the lines that the page has a person type are typed here, at a virtual
Ping360 that takes its time and an autopilot with attitude, depth and thrusters, until a direction is clear."""
import math
import os
import random
import re
import shlex
import socket
import struct
import subprocess
import threading
import time

from lib import BUILD, PATIENCE, Process, SONARCTL, SONARD, check, free_port, note, run, until
from mavlink_frame import ATTITUDE, COMMAND_LONG, HEARTBEAT, PARAM_REQUEST_READ, PARAM_VALUE, SCALED_PRESSURE, SCALED_PRESSURE2, SERVO_OUTPUT_RAW, VFR_HUD, frame

PAGE = "docs/without-a-dvl.md"
WITHIN_S = 300
FUNCTIONS = {"SERVO%d_FUNCTION" % (i + 1): (33 + i if i < 6 else 0) for i in range(16)}
DIRECTIONS = {"MOT_%d_DIRECTION" % (i + 1): 1 for i in range(8)}
PARAMETERS = dict(FUNCTIONS, **DIRECTIONS, FRAME_CONFIG=1, BARO_PRIMARY=1)
SET_INTERVAL = 511
# Of roll, pitch and yaw: degrees at rest, rad/s of the sway about them, and degrees of noise. In two logs of BlueROV2s ATTITUDE lies, as a standard
# deviation, up to 0.03 degrees (yaw: 0.004) beside a line over 0.2 s.
SWAY = ((0, 1.7, 0.05), (0, 1.3, 0.05), (30, 0.9, 0.007))


class Autopilot(threading.Thread):
    """ArduSub as it sends unasked: a heartbeat, attitude, climb, both barometers, and what the thrusters do twice a second, until somebody asks for
    more. The vehicle dives two metres down and holds that depth: the vertical thrusters work a little, the others idle."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.to = ("127.0.0.1", port)
        self.ended, self.fault = threading.Event(), None
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(0.01)
        self.every_s = {SERVO_OUTPUT_RAW: 0.5, VFR_HUD: 0.5, ATTITUDE: 0.1, SCALED_PRESSURE: 0.5, SCALED_PRESSURE2: 0.5, HEARTBEAT: 1}
        self.due_s = dict.fromkeys(self.every_s, 0)
        self.sequence, self.random, self.start_s = 0, random.Random(1), time.monotonic() - 100

    def send(self, message_id, payload):
        self.sequence += 1
        self.socket.sendto(frame(message_id, payload, self.sequence), self.to)

    def depth(self, boot_s):
        return min(2, 0.2 * max(0, boot_s - 110)) + self.random.uniform(-0.003, 0.003)

    def payload(self, message_id):
        boot_s, noise = time.monotonic() - self.start_s, self.random.uniform
        if message_id == HEARTBEAT:
            return struct.pack("<IBBBBB", 2, 12, 3, 0x81, 4, 3)  # ALT_HOLD, submarine, armed
        if message_id == ATTITUDE:
            roll, pitch, yaw = (math.radians(rest + 0.5 * math.sin(boot_s * rate) + noise(-beside, beside)) for rest, rate, beside in SWAY)
            return struct.pack("<I6f", int(boot_s * 1000), roll, pitch, yaw, 0, 0, 0)
        if message_id == VFR_HUD:
            climbs = -0.2 if 110 < boot_s < 120 else 0
            return struct.pack("<4fhH", 0, 0, -self.depth(boot_s), climbs + noise(-0.01, 0.01), 30, 0)
        if message_id in (SCALED_PRESSURE, SCALED_PRESSURE2):  # in the hull, in the water
            hpa = 1013.25 + (98.1 * self.depth(boot_s) if message_id == SCALED_PRESSURE2 else 0)
            return struct.pack("<Iffhh", int(boot_s * 1000), hpa, 0, 1500, 0)
        pulses = [1500] * 4 + [1500 + int(noise(-10, 50)) for _ in range(2)] + [0, 0]
        return struct.pack("<I8HB", int(boot_s * 1e6) & 0xFFFFFFFF, *pulses, 0)

    def answer(self, message):
        message_id = int.from_bytes(message[7:10], "little")
        payload = message[10:10 + message[1]] + bytes(60)
        if message_id == PARAM_REQUEST_READ:
            name = payload[4:20].rstrip(b"\0").decode()
            if name in PARAMETERS:
                self.send(PARAM_VALUE, struct.pack("<fHH16sB", PARAMETERS[name], 900, 0xFFFF, name.encode(), 6))
        elif message_id == COMMAND_LONG:
            number, interval_us = struct.unpack_from("<2f", payload)
            if struct.unpack_from("<H", payload, 28)[0] == SET_INTERVAL and int(number) in self.every_s and interval_us > 0:
                self.every_s[int(number)] = interval_us * 1e-6

    def run(self):
        try:
            while not self.ended.is_set():
                for message_id, every_s in self.every_s.items():
                    if time.monotonic() >= self.due_s[message_id]:
                        self.due_s[message_id] = time.monotonic() + every_s
                        self.send(message_id, self.payload(message_id))
                try:
                    self.answer(self.socket.recv(1000))
                except (socket.timeout, ConnectionRefusedError):
                    continue
        except Exception as fault:
            self.fault = fault


class Typed:
    """The page's lines, with this machine's paths in them: every line has to be one that is known here."""

    def __init__(self, bench, port):
        self.bench, self.mavlink = bench, port
        self.conf, self.options = bench.path("sonard.conf"), bench.path("sonard-mavlink")
        bench.write("sonard.conf", "[server]\nsocket = %s\n" % bench.socket_path)
        os.mkdir(self.conf + ".d")
        self.told = []

    def here(self, line):
        for theirs, ours in (("sudo ", ""), ("/dev/ttyUSB0", self.bench.port_path), ("/etc/sonard/sonard.conf", self.conf),
                             ("/etc/default/sonard-mavlink", self.options), ("14660", str(self.mavlink))):
            line = line.replace(theirs, ours)
        return line

    def type(self, line):
        line = self.here(line)
        words = shlex.split(line)
        self.told.append(words[0])
        if words[0] == "apt":
            return ""
        if line == "systemctl enable --now sonard":
            self.bench.sonard().client()
        elif line == "systemctl enable --now sonard-mavlink":
            with open(self.options, encoding="ascii") as f:
                options = shlex.split(f.read().split("=", 1)[1])[0].split()
            self.bridge = Process(self.bench, "bridge", [os.path.join(BUILD, "sonard-mavlink"), "--socket", self.bench.socket_path] + options)
            self.bench.processes.append(self.bridge)
        elif words[0] == "echo":
            subprocess.run(line, shell=True, check=True, stdout=subprocess.DEVNULL)
        elif words[:2] == ["sonarctl", "setup"]:
            self.ends_well(SONARCTL, *words[1:], "--output", self.conf + ".d/50-setup.conf")
        elif words[0] == "sonarctl":
            return self.ends_well(SONARCTL, "--socket", self.bench.socket_path, "--timeout", "60", *words[1:])
        elif words[0] == "sonard":
            self.ends_well(SONARD, *words[1:])
        else:
            check(False, "%s has a line that this test cannot type: %s" % (PAGE, line))
        return ""

    def ends_well(self, program, *arguments):
        done = self.bench.run(program, *arguments)
        check(done.returncode == 0, "%s: %d %s" % (arguments, done.returncode, done.stdout + done.stderr))
        return done.stdout


def typed_as_documented(bench):
    """From the configured machine to the first clear, as a person gets there."""
    with open(PAGE, encoding="utf-8") as f:
        section = f.read().split("\n## From the package to the first clear\n")[1].split("\n## ")[0]
    lines = re.findall(r"^    \$ (.+)$", section, re.M)
    bench.sim(scene="harbour", quick=False)
    typed = Typed(bench, free_port())
    autopilot = Autopilot(typed.mavlink)
    autopilot.start()
    begin_s = time.monotonic()
    asked = [line for line in lines if line in ("sonarctl status", "sonarctl sectors")]
    for line in lines:
        if line not in asked:
            typed.type(line)
    check(len(asked) == 2 and len(typed.told) >= 6, "typed: %s" % lines)
    words = set()

    def clear():
        check(autopilot.fault is None, "the autopilot: %r" % autopilot.fault)
        ring = typed.type("sonarctl sectors")
        words.update(re.findall(r"\d unknown(?:: (.*))?$", ring, re.M))
        return int(re.search(r"(\d+) clear", ring).group(1)) > 0

    until(clear, "the first clear", WITHIN_S, 1)
    took_s = time.monotonic() - begin_s
    status = typed.type("sonarctl status")
    check(", by thrusters and `current`" in status and "no depth" not in status, status)
    check("the autopilot's depth sensor by BARO_PRIMARY" in typed.bridge.log(), typed.bridge.log())
    check(took_s <= WITHIN_S * PATIENCE, "%g s" % took_s)
    autopilot.ended.set()
    autopilot.join()
    note("%.0f s; said on the way: %s" % (took_s, "; ".join(sorted(re.sub(r"\d+\.\d+ m", "... m", w) for w in words if w))))


run([("typed_as_documented", typed_as_documented)])
