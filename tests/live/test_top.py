#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""`sonarctl top` on a terminal: what it shows of a daemon that lives, is blind, hangs or is gone, and that the terminal is as
it was afterwards, whatever ends it."""
import fcntl
import os
import pty
import re
import select
import signal
import struct
import termios

from lib import ALL, PATIENCE, SONARCTL, check, run, until

ESCAPE = re.compile(r"\x1b\[[?0-9;]*[A-Za-z]")


class Screen:
    """A terminal of so many columns and rows with `sonarctl top` on it. Rows are kept as they are written; each write of a
    row begins with a move to its beginning, which is all that top uses."""

    def __init__(self, bench, columns=80, rows=24, **env):
        self.master, self.slave = pty.openpty()
        self.resize(columns, rows)
        self.before = termios.tcgetattr(self.slave)
        self.raw, self.lines = "", {}
        self.pid = os.fork()
        if self.pid == 0:
            os.setsid()
            fcntl.ioctl(self.slave, termios.TIOCSCTTY, 0)
            for i in range(3):
                os.dup2(self.slave, i)
            variables = dict(os.environ, LC_ALL="C.UTF-8", **env)
            if "NO_COLOR" not in env:
                variables.pop("NO_COLOR", None)
            os.execve(SONARCTL, [SONARCTL, "--socket", bench.socket_path, "top"], variables)

    def resize(self, columns, rows):
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def read(self, wait_s=0.05):
        while select.select([self.master], [], [], wait_s)[0]:
            self.raw += os.read(self.master, 65536).decode(errors="replace")
        self.lines = {}
        for part in re.split(r"\x1b\[(?=\d+;1H)", self.raw)[1:]:
            row, text = part.split(";1H", 1)
            self.lines[int(row)] = ESCAPE.sub("", text)
        return "\n".join(self.lines[row] for row in sorted(self.lines))

    def shows(self, pattern):
        return until(lambda: re.search(pattern, self.read()), "top shows " + pattern)

    def key(self, key):
        os.write(self.master, key.encode())

    def given_back(self):
        until(lambda: self.read() is not None and self.raw.endswith("\x1b[?1049l"), "the screen to be given back")

    def end(self):
        """The exit status, after the terminal was given back."""
        status = until(lambda: (lambda got: got[0] == self.pid and [got[1]])(os.waitpid(self.pid, os.WNOHANG)), "top ends")[0]
        self.given_back()
        check(termios.tcgetattr(self.slave) == self.before, "the terminal is not as it was")
        check(self.raw.startswith("\x1b[?1049h"), "it took another screen")
        check("\x1b[?25h" in self.raw[-40:], "the cursor is gone")
        os.close(self.master)
        os.close(self.slave)
        return os.waitstatus_to_exitcode(status)


def start(bench, **sections):
    sim = bench.sim()
    bench.conf(**sections)
    daemon = bench.sonard()
    client = daemon.client()
    until(lambda: client.call("blocked", azimuth_deg=0, distance_m=9, half_angle_deg=5)["state"] == "blocked", "the wall")
    client.close()
    return sim, daemon


def once(bench):
    """One frame: of the size asked for, without an escape sequence, and in ASCII where the locale has no more."""
    start(bench)
    for columns, rows, locale in ((80, 24, "C.UTF-8"), (80, 24, "C"), (120, 40, "C.UTF-8"), (30, 8, "C"), (1, 1, "C")):
        def frame(columns=columns, rows=rows, locale=locale):
            """Of a large one, one with data: the sonar may be late."""
            out = bench.run("env", "COLUMNS=%d" % columns, "LINES=%d" % rows, "LC_ALL=" + locale, SONARCTL, "--socket", bench.socket_path,
                            "top", "--once")
            check(out.returncode == 0, "%d: %s" % (out.returncode, out.stderr))
            return (rows < 24 or "data ok" in out.stdout) and out.stdout
        out = until(frame, "a frame with data")
        lines = out.split("\n")[:-1]
        check(len(lines) == rows, "%d lines of %d" % (len(lines), rows))
        check(all(len(line) <= columns for line in lines), "wider than %d" % columns)
        check("\x1b" not in out and (locale != "C" or out.isascii()), "not plain: %r" % out)
        if rows >= 24:
            check("head  running" in out and "ping_to_picture" in out, out)
            check(re.search(r"nearest  \d+\.\d\d m at", out) and re.search(r"[0-9+]{3}", out.split("nearest")[0]), out)
            check(re.search("#" if locale == "C" else "[\u2800-\u28ff]", out), "no plan")
    check(bench.sonarctl("top").returncode == 3, "without a terminal it is wrong usage")
    check(bench.run(SONARCTL, "--socket", bench.path("none"), "top", "--once").returncode == 4, "no daemon")
    check(bench.sonarctl("top", "--once", "--count", "0").returncode == 6, "a parameter that the daemon refuses")


def live(bench):
    """Rates, keys, another size, and what it says of a sonar, and then a daemon, that is gone; it comes back by itself."""
    sim, daemon = start(bench)
    screen = Screen(bench)
    screen.shows(r"data ok")
    screen.shows(r"\d+(\.\d)? pings/s")
    screen.shows(r"edge 10 m")
    screen.key("-")
    screen.shows(r"edge 20 m")
    screen.key("+")
    screen.shows(r"edge 10 m")
    screen.resize(100, 30)
    until(lambda: screen.read() and max(screen.lines) == 30, "the new size")
    check("\x1b[0;1;31m" in screen.raw and "\x1b[0;32m" in screen.raw, "no colour")
    sim.stop()
    screen.shows(r"NO NEW DATA: no data from the sonar")
    screen.shows(r"! head: ")
    daemon.process.send_signal(signal.SIGSTOP)
    try:
        plan = lambda: "\n".join(screen.lines.get(row, "") for row in range(3, 30))
        until(lambda: screen.read() and "is silent" in screen.lines[2] and not re.search("[0-9+c\u2801-\u28ff]", plan()),
              "it says that the daemon is silent, and shows nothing of its water")
    finally:
        daemon.process.send_signal(signal.SIGCONT)
    until(lambda: screen.read() and "NO NEW DATA" in screen.lines[2], "it speaks again")
    daemon.stop()
    until(lambda: screen.read() and "no daemon answers" in screen.lines[2], "it says that the daemon is gone")
    bench.sonard()
    until(lambda: screen.read() and "DATA" in screen.lines[2], "another daemon")
    screen.key("q")
    check(screen.end() == 0, "q ends it well")


def given_back(bench):
    """q, an interrupt, signals, a terminal that was stopped: the terminal is as it was."""
    start(bench)
    for key in ("q", "\x03"):
        screen = Screen(bench)
        screen.shows(r"data ok")
        screen.key(key)
        check(screen.end() == 0, "%r" % key)
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGPIPE):
        screen = Screen(bench)
        screen.shows(r"data ok")
        os.kill(screen.pid, number)
        check(screen.end() == 0, "%s" % number)
    screen = Screen(bench, NO_COLOR="1")
    screen.shows(r"data ok")
    os.kill(screen.pid, signal.SIGTSTP)
    until(lambda: os.waitpid(screen.pid, os.WNOHANG | os.WUNTRACED)[0] == screen.pid, "it stops")
    screen.given_back()
    check(termios.tcgetattr(screen.slave) == screen.before, "stopped, it keeps the terminal")
    screen.raw = screen.raw[:8] + " "
    os.kill(screen.pid, signal.SIGCONT)
    screen.shows(r"data ok")
    check(not re.search(r"\x1b\[[0-9;]*3[0-9]m", screen.raw), "colours with NO_COLOR")
    screen.key("q")
    check(screen.end() == 0, "after it was stopped")


run([("top_" + f.__name__, f) for f in (once, live, given_back)], parallel=3, gate=ALL)
