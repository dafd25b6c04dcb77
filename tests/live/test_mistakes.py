#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Mistakes of the first hour, each with what its message must name - what is wrong, where, and what would be right - and
the exit status. A message that a user cannot act on is a fault."""
import os
import pty
import shutil
import socket
import subprocess

from lib import SONARCTL, SONARD, Skipped, check, note, run, until

BRIDGE = SONARD + "-mavlink"
PING360 = "[sonar front]\ndevice = ping360\nport = serial:/dev/ttyUSB0:115200\n"

# what somebody writes into a configuration, and what `sonard --check` says of it: the place first
CONFIGURATIONS = (
    ("device in capitals", PING360.replace("ping360", "Ping360"), (":2: [sonar front] device = Ping360", "did you mean ping360?")),
    ("device of another name", PING360.replace("ping360", "blueview"), (":2:", "unknown device; supported: micron", "ping360")),
    ("port without its kind", PING360.replace("serial:", ""), (":3:", "port = /dev/ttyUSB0", "for instance serial:/dev/ttyUSB0:115200")),
    ("port without its folder", PING360.replace("/dev/", ""), (":3:", "as /dev/ttyUSB0:115200")),
    ("baud rate that is none", PING360.replace("115200", "115201"), (":3:", "baud rate '115201'", "115200")),
    ("port of no kind", PING360.replace("serial:/dev/ttyUSB0", "http:192.168.2.2"), (":3:", "kinds: serial udp tcp")),
    ("baud rate over TCP", PING360.replace("serial:/dev/ttyUSB0", "tcp:192.168.2.2:4001"),
     (":3:", "the baud rate is set in the device server")),
    ("name of a host", PING360.replace("serial:/dev/ttyUSB0:115200", "udp:blueos.local:9092"), (":3:", "numeric address, as 192.168.2.2")),
    ("number without a unit", PING360 + "range = 20\n", (":4:", "range = 20", "the unit is missing", "0.75 to 200 m")),
    ("unit that is none", PING360 + "range = 20 ft\n", (":4:", "unknown unit 'ft'", "m, cm, mm, km")),
    ("range beyond the device", PING360 + "range = 500 m\n", (":4:", "out of range", "0.75 to 200 m")),
    ("typo in a key", PING360 + "rnage = 20 m\n", (":4:", "rnage", "did you mean range?")),
    ("typo in a section", "[sonra front]\n", (":1: [sonra front]", "did you mean [sonar NAME]?")),
    ("sonar without a name", "[sonar]\ndevice = ping360\n", (":1: [sonar]", "[sonar NAME]")),
    ("mount of two numbers", PING360 + "mount = 0.2 0.1 m\n", (":4:", "2 of 3 numbers")),
    ("word that is none", PING360 + "mode = fast\n", (":4:", "auto, transmit or request")),
    ("key of another section", PING360 + "[vehicle]\nspeed = 1 m/s\n", (":5: [vehicle] speed", "max_speed")),
    ("the same sonar twice", PING360 + PING360, (":4: [sonar front]", "line 1")),
    ("comment behind a #", PING360 + "range = 20 m # far\n", (":4:", "start a comment with ;")),
    ("no device", "[sonar front]\nport = serial:/dev/ttyUSB0:115200\n", (":1: [sonar front] device", "for instance ping360")),
    ("socket without a folder", PING360 + "[server]\nsocket = sonard.sock\n", (":5: [server] socket", "an absolute path")),
)

# program, words, exit status, what the message names; CONF is a good configuration, NONE a file that is not there
COMMANDS = (
    ("azimuth in words", SONARCTL, ("blocked", "north", "--distance", "5"), 3, ("AZ 'north': expected degrees, -360 to 360",)),
    ("no azimuth", SONARCTL, ("blocked", "--distance", "5"), 3, ("usage: sonarctl blocked AZ --distance M",)),
    ("no distance", SONARCTL, ("blocked", "30"), 3, ("--distance D is missing", "blocked --help")),
    ("distance with a unit", SONARCTL, ("blocked", "30", "--distance", "5m"), 3, ("--distance 5m: expected M as a plain number, such as 5: how far to look ahead, in m",)),
    ("typo in an option", SONARCTL, ("blocked", "30", "--distnace", "5"), 3, ("--distnace", "did you mean --distance?")),
    ("typo in a command", SONARCTL, ("bloked", "30"), 3, ("no command 'bloked'", "did you mean blocked?")),
    ("attitude of two angles", SONARCTL, ("pose", "--attitude", "0,90"), 3, ("--attitude 0,90", "roll, pitch, yaw, in degrees")),
    ("pose of nothing", SONARCTL, ("pose",), 3, ("at least one part", "--attitude 0,0,90")),
    ("plot without a file", SONARCTL, ("plot",), 3, ("-o FILE is missing",)),
    ("plot of another kind", SONARCTL, ("plot", "-o", "now.PNG"), 3, ("writes SVG", "rsvg-convert")),
    ("map of another kind", SONARCTL, ("map", "draw", "-o", "map.png"), 3, ("writes SVG", "rsvg-convert")),
    ("background of another kind", SONARCTL, ("background", "show", "--svg", "own.pdf"), 3, ("writes SVG", "rsvg-convert")),
    ("no daemon", SONARCTL, ("--socket", "NONE", "status"), 4, ("NONE", "is sonard running")),
    ("a file as a socket", SONARCTL, ("--socket", "CONF", "status"), 4, ("CONF is not a socket",)),
    ("socket that a dead daemon left", SONARCTL, ("--socket", "OLD", "status"), 4, ("OLD", "Connection refused", "is sonard running")),
    ("capture that is none", SONARCTL, ("capture", "info", "CONF"), 1, ("CONF: not a capture", "MCAP")),
    ("import of something else", SONARCTL, ("capture", "import", "CONF", "NONE"), 1, ("CONF: neither a Ping-Viewer sensor log",)),
    ("import over a file", SONARCTL, ("capture", "import", "tests/replay/box-head.txt", "CONF"), 1, ("CONF: File exists; remove it first",)),
    ("export over a file", SONARCTL, ("capture", "export", "--csv", "tests/replay/box.mcap", "CONF"), 1, ("CONF: File exists; remove it first",)),
    ("replay of an empty file", SONARD, ("--replay", "EMPTY"), 1, ("sonard: EMPTY: the file is empty\n",)),
    ("export without a form", SONARCTL, ("capture", "export", "CONF"), 2, ("export needs --csv",)),
    ("replay without a file", SONARD, ("--replay",), 2, ("--replay CAPTURE.mcap",)),
    ("replay of nothing", SONARD, ("--replay", "NONE"), 1, ("NONE: No such file",)),
    ("replay of another program's recording", SONARD, ("--replay", "CONF"), 1, ("CONF: not a capture", "; not a CAN log, either: no line of it", "`sonarctl capture import`", "`sonard-rosbag`")),
    ("replay of a folder", SONARD, ("--replay", "/tmp"), 1, ("/tmp: not a file",)),
    ("configuration as a word", SONARD, ("CONF",), 2, ("-c CONF",)),
    ("check of a program", SONARD, ("--check", "/bin/sh"), 1, ("/bin/sh:1: byte 0x7f in column 1; expected text in UTF-8",)),
    ("check of a picture", SONARD, ("--check", "PICTURE"), 1, ("PICTURE:1: byte 0x89 in column 1; expected text in UTF-8",)),
    ("letters that are no options", SONARD, ("-Zh",), 2, ("sonard: no option -Z; see `sonard --help`",)),
    ("value for an option that takes none", SONARD, ("--print=CONF",), 2, ("option --print=", "takes no value", "sonard --help")),
    ("typo in an option of the daemon", SONARD, ("--chekc", "CONF"), 2, ("--chekc", "did you mean --check?")),
    ("configuration that is not there", SONARD, ("-c", "NONE"), 3, ("NONE: cannot be read", "No such file")),
    ("no configuration at all", SONARD, (), 3, ("no configuration at", "-c FILE", "sonarctl setup --output")),
    ("speed without a replay", SONARD, ("-c", "CONF", "--speed", "2"), 2, ("--speed", "--replay")),
    ("bridge without a link", BRIDGE, (), 3, ("--link LINK is missing",)),
    ("bridge over TCP", BRIDGE, ("--link", "tcp:192.168.2.2:5760"), 3, ("TCP is not supported", "udpin:PORT", "udp:HOST:PORT")),
    ("bridge without a port", BRIDGE, ("--link", "udp:192.168.2.2"), 3, ("udp:HOST:PORT",)),
)


def faults(what, done, status, wanted):
    said = done.stderr
    missing = [words for words in wanted if words not in said]
    if done.returncode != status or missing or done.returncode < 0:
        yield "%s: status %d (expected %d), no %s in: %s" % (what, done.returncode, status, missing, said.strip())
    first = said.split("\n\nusage:")[0].strip()
    if len(first.splitlines()) > 2:
        yield "%s: %d lines: %s" % (what, len(first.splitlines()), first)


def configurations(bench):
    wrong = []
    for what, text, wanted in CONFIGURATIONS:
        path = bench.write("mistake.conf", text)
        done = bench.run(SONARD, "--check", path)
        wrong += faults(what, done, 1, (path,) + wanted)
    note("%d mistakes in a configuration" % len(CONFIGURATIONS))
    check(not wrong, " || ".join(wrong))


def options(bench):
    """Every program tells an option that it does not have in the same words."""
    tools = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "python")
    programs = [((SONARD,), "sonard", "sonard --help"), ((BRIDGE,), "sonard-mavlink", "sonard-mavlink --help"),
                ((SONARCTL,), "sonarctl", "sonarctl help"), ((SONARCTL, "blocked"), "sonarctl", "sonarctl blocked --help"),
                ((SONARCTL, "capture", "info"), "sonarctl capture", "sonarctl capture --help")]
    if os.path.exists(SONARD + "-web"):
        programs.append(((SONARD + "-web",), "sonard-web", "sonard-web --help"))
    for name in ("sonard-import", "sonard-poses", "sonard-report", "sonard-rosbag", "sonard-tune"):
        programs.append(((os.path.join(tools, name),), name, name + " --help"))
    for program, name, where in programs:
        for option, told in (("--wrong-one", "--wrong-one; see `%s`" % where), ("-Z", "-Z; see `%s`" % where),
                             ("--wrong=1", "--wrong; see `%s`" % where), ("--hlep", "--hlep; did you mean --help?")):
            done = bench.run(*program, option)
            check(done.returncode in (2, 3) and done.stderr == "%s: no option %s\n" % (name, told), "%s %s: %d %s" % (program, option, done.returncode, done.stderr))


def commands(bench):
    old = socket.socket(socket.AF_UNIX)
    old.bind(bench.path("old.sock"))
    old.listen()
    old.close()
    places = {"CONF": bench.write("good.conf", PING360), "NONE": bench.path("none"), "OLD": bench.path("old.sock"),
              "EMPTY": bench.write("empty.mcap", ""), "PICTURE": bench.write("x.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\n\xff\n\xfe\n")}

    def placed(text):
        for name, path in places.items():
            text = text.replace(name, path)
        return text
    wrong = []
    for what, program, words, status, wanted in COMMANDS:
        if program == SONARD and not words and os.path.exists("/etc/sonard/sonard.conf"):
            continue
        done = bench.run(program, *map(placed, words))
        wrong += faults(what, done, status, map(placed, wanted))
    note("%d mistakes on a command line" % len(COMMANDS))
    check(not wrong, " || ".join(wrong))


def port_of_another_process(bench):
    """The line is open elsewhere: the log says so and what to do, and sonard waits for it."""
    bench.sim()
    bench.conf()
    first = bench.sonard()
    first.client()
    until(lambda: first.client().sensor()["state"] == "running", "the first daemon")
    conf = bench.conf(name="second.conf", server={"socket": bench.path("second.sock")})
    second = bench.sonard(conf=conf)
    until(lambda: "in use by another process" in second.log(), "the message")
    check(bench.port_path in second.log(), second.log())
    second.stop()
    third = bench.run(SONARD, "-c", bench.path("sonard.conf"))
    check(third.returncode == 1 and "another sonard is listening on " + bench.socket_path in third.stderr, third.stderr)


def missing_group(bench):
    """Who may not use the socket, or the serial port, is told of the group."""
    if os.getuid() != 0 or not shutil.which("setpriv"):
        raise Skipped("only root can be somebody else")
    bench.sim()
    bench.conf(server={"mode": "0600"})
    bench.sonard().client()
    os.chmod(bench.folder, 0o755)
    somebody = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups"]
    done = subprocess.run(somebody + [SONARCTL, "--socket", bench.socket_path, "status"], capture_output=True, text=True,
                          check=False, timeout=30)
    check(done.returncode == 4 and "no permission to use " + bench.socket_path in done.stderr and "group" in done.stderr, done.stderr)
    leader, follower = pty.openpty()
    os.chmod(os.ttyname(follower), 0o600)
    conf = bench.write("theirs.conf", "[sonar front]\ndevice = ping360\nport = serial:%s:115200\n" % os.ttyname(follower))
    os.chmod(conf, 0o644)
    child = subprocess.Popen(somebody + [SONARD, "-c", conf, "--socket", "none"], stderr=subprocess.PIPE, text=True)
    try:
        line = next(line for line in child.stderr if "cannot be opened" in line)
        check("dialout" in line and "Permission denied" in line, line)
    finally:
        child.terminate()
        child.wait(30)
        child.stderr.close()
        os.close(leader)
        os.close(follower)


def refused_poses(bench):
    """What no pose can be is refused with what would be right."""
    bench.sim()
    bench.conf()
    bench.sonard().client()
    done = bench.sonarctl("pose", "--quaternion", "1,1,1,1")
    check(done.returncode == 6 and "quaternion is not of length 1 (w, x, y, z)" in done.stderr, done.stderr)
    done = bench.sonarctl("pose", "--time", "1700000000", "--attitude", "0,0,0")
    check(done.returncode == 6 and "off this computer's clock" in done.stderr and "at most 10 s" in done.stderr, done.stderr)


run([("configurations", configurations), ("commands", commands), ("options", options), ("port_of_another_process", port_of_another_process),
     ("missing_group", missing_group), ("refused_poses", refused_poses)], parallel=2,
    gate=("configurations", "commands", "options", "missing_group"))
