# SPDX-License-Identifier: MIT
"""voyage - a dive in virtual time, for tests that depend on no clock: a virtual sonar and the poses that a test gives make a
capture, which `sonard --replay --stay` plays and then answers from, its clock standing still at the end.

A test configures its bench, makes a Voyage, lets time pass, and asks a client, as a live test does. What takes an hour on the
vehicle takes a second here, and the same bytes come out on every machine.
"""
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "live"))
from lib import BUILD, Failed, Process, check, helper, until  # pylint: disable=wrong-import-position

BAUD = "4000000"  # as the device is told


class Voyage(Process):
    """A virtual sonar with these options in the water, at 0 s of virtual time, by the configuration that the bench has."""

    def __init__(self, bench, program="ping360_sim", *options, truth=False):
        self.bench = bench
        self.capture = bench.path("voyage%d.mcap" % len(bench.processes))
        full = [os.path.join(BUILD, "tests", program), "--baud", BAUD] + list(options)
        if truth:
            full += ["--truth", bench.path("truth")]
        super().__init__(bench, "voyage%d" % len(bench.processes), [helper("voyage"), bench.path("sonard.conf"), self.capture] + full,
                         stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        bench.processes.append(self)
        self.now_s, self.made = 0.0, 0  # virtual time, and pings so far
        self._answer("ready", "it does not start")

    def _answer(self, word, what):
        line = self.process.stdout.readline().decode().strip()
        check(line.startswith(word), "%s: %s %s" % (what, line, self.log()))
        return line.split()[1:]

    def _command(self, text):
        self.process.stdin.write(text.encode() + b"\n")
        self.process.stdin.flush()
        seconds, pings = self._answer("ok", text)
        self.now_s, self.made = float(seconds), int(pings)

    def run(self, seconds):
        self._command("run %.9f" % seconds)

    def pings(self, count):
        """Lets time pass until the sonar has made so many more pings."""
        self._command("pings %d" % count)

    def sonar(self, command):
        """A command of the virtual sonar."""
        self._command("sonar " + command)

    def pose(self, **params):
        """What a client says of the pose."""
        self._command("pose " + json.dumps(params))

    def place(self, north_m, east_m, down_m, yaw_deg=0.0, **also):
        """The vehicle is there, in the water and for the daemon."""
        self.sonar("pose %.6f %.6f %.6f %.6f" % (north_m, east_m, down_m, yaw_deg))
        self.pose(attitude_deg=[0, 0, yaw_deg], position_m=[north_m, east_m, down_m], **also)

    def end(self):
        """The voyage is over: the path of its capture."""
        if self.status is None:
            self.process.stdin.write(b"end\n")
            self.process.stdin.close()
            self._answer("ok", "end")
            check(self.wait() == 0, self.log())
            self.process.stdout.close()
        return self.capture

    def stop(self):
        """Of one that a test has left: it ends with its input."""
        if not self.process.stdin.closed:
            self.process.stdin.close()
        status = self.wait()
        self.process.stdout.close()
        return status

    def daemon(self, *arguments, **pipes):
        """A sonard that has played all of it."""
        daemon = self.bench.sonard("--replay", self.end(), "--stay", *arguments, conf=False, **pipes)
        client = daemon.client()
        until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay", 60)
        client.close()
        return daemon

    def client(self, *arguments):
        return self.daemon(*arguments).client()

    def moments(self, *arguments):
        """A function that gives a client whose clock stands at a moment of the voyage, in s. Ask in the order of time: a daemon
        that is sent back to an earlier moment forgets what it was asked, and begins anew."""
        daemon = self.bench.sonard("--replay", self.end(), "--stay", "--speed", "0.001", *arguments, conf=False)

        def at(s):
            there = daemon.client()
            there.call("replay", pause="yes", to_s=s)
            there.close()

            def client():
                asked = daemon.client()
                try:
                    if not asked.call("status")["replay"]["jumping"]:
                        return asked
                except (OSError, Failed):  # it begins anew
                    pass
                asked.close()
                return None
            return until(client, "the moment %g s" % s, 60)
        at(0)
        return at


def ping360(bench, *options, scene="box", **keys):
    """A voyage of a Ping360 with a quicker motor and processor than the real head's, as live tests have it."""
    return Voyage(bench, "ping360_sim", "--scene", scene, "--ms-per-gradian", "1", "--processing-ms", "2", *options, **keys)
