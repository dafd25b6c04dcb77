#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""`sonarctl setup`: the sonar is found by listening or by one question that changes nothing, the rest is asked or given
as options, and what is written passes the check and runs."""
import fcntl
import os
import pty
import random
import shutil
import socket
import subprocess

from lib import PATIENCE, SEED, SONARCTL, SONARD, check, free_port, pings_until, run

ODD_PORTS = ("/dev/null", "serial:/dev/null:9600", "udp:192.168.2.2:9092", "udp:192.168.2.2:9092:listen", "tcp:bridge:4001", "can:can0",
             "isotp:can0:123:321", "canstream:can0:100:101")
ODD_OPTIONS = [("--range", m) for m in ("0.75", "1", "2.5", "20", "50", "50.5", "75", "100", "150", "200")] + [
    ("--mount", m) for m in ("0,0,0", "50,-50,50", "0.001,0,-3")] + [("--size", m) for m in ("0.1,0.1,0.1", "50,50,50", "50,0.1,0.1")] + [
        ("--current", mps) for mps in ("0", "0.05", "5")] + [("--name", name) for name in ("-", "_0", "n" * 31)] + [
            ("--near",), ("--upside-down",), ("--near", "--current", "5", "--range", "0.75"), ("--size", "50,50,50", "--near", "--range", "50")]


def setup(bench, *options, **pipes):
    return bench.run(SONARCTL, "setup", "--yes", *options, **pipes)


def found(program, device, *arguments, quiet=False):
    """A virtual sonar on a pseudo-terminal is found; a Ping360 was asked who it is and nothing else: it has not pinged."""
    def case(bench):
        sim = bench.twin(program, "--link", bench.port_path, *arguments)
        out = bench.path("drop-in.conf")
        done = setup(bench, "--port", bench.port_path, "--output", out, *(["--listen"] if quiet else []))
        check(done.returncode == 0 and "found: " + device in done.stderr, done.stderr)
        check(program != "ping360_sim" or sim.pings() == 0, "it pinged")
        check(done.stderr.endswith("Use it: sonard -c %s\n" % out), done.stderr)
        done = bench.run(SONARD, "--check", out)
        check(done.returncode == 0, done.stderr)
        with open(out, encoding="ascii") as f:
            text = f.read()
        check("device = %s " % device in text and "port = serial:%s:" % bench.port_path in text, text)
        keys = [line.split(" = ")[0] for line in text.splitlines() if " = " in line and line[0] != "#"]
        check(keys == ["device", "port"], "nobody answered: %s" % keys)
        check((device == "ping360") == ("\nport = serial:%s:921600\n" % bench.port_path in text), text)
        check((device == "ping360") == ("\n#near = 3.4 m\n" in text), text)
        daemon = bench.sonard("--socket", bench.socket_path, conf=out)
        pings_until(daemon.client(), 2)
    return case


def options(bench):
    """All that can be given is written, and nothing is sent anywhere."""
    done = setup(bench, "--device", "micron", "--port", "udp:192.168.2.2:9092", "--name", "bow", "--mount", "0.2,0,-0.1",
                 "--size", "1,0.5,0.4", "--range", "30", "--upside-down", "--output", "-")
    check(done.returncode == 0 and "listening" not in done.stderr, done.stderr)
    for line in ("[sonar bow]", "device = micron", "port = udp:192.168.2.2:9092", "range = 30 m", "mount = 0.2 0 -0.1 m",
                 "rotation = 180 0 0 deg", "radius = 0.56 m", "height = 0.4 m"):
        check("\n%s\n" % line in done.stdout, "no %s in %s" % (line, done.stdout))
    check("by-id" not in done.stdout and "near" not in done.stdout, done.stdout)
    done = setup(bench, "--device", "ping360", "--port", "serial:/dev/ttyUSB0:115200", "--size", "1,0.5,0.2", "--output", "-")
    check("\nport = serial:/dev/ttyUSB0:115200\n" in done.stdout and "\n#near = 2.5 m\n" in done.stdout, done.stdout)
    done = setup(bench, "--device", "micron", "--port", "udp:192.168.2.2:9092", "--current", "0.3", "--output", "-")
    check("[vehicle]\n# A promise" in done.stdout and "\ncurrent = 0.3 m/s\n" in done.stdout, done.stdout)
    check("max_speed = 1.5 m/s" in done.stdout and "look_ahead = 6 m" in done.stdout and "step" not in done.stdout, done.stdout)
    done = setup(bench, "--device", "ping360", "--port", "udp:192.168.2.2:9092", "--current", "0.05", "--output", "-")
    check("range = 10 m" in done.stdout and "step = 1.8 deg" in done.stdout, done.stdout)
    done = setup(bench, "--device", "ping360", "--port", "serial:/dev/ttyUSB0:115200", "--mount", "0,0,-0.4", "--output", "-")
    check("\n#near = 5.8 m\n" in done.stdout, done.stdout)
    done = setup(bench, "--device", "micron", "--port", "udp:192.168.2.2:9092", "--near", "--output", "-")
    check("near" not in done.stdout and "--near is for a Ping360 and was left out for micron" in done.stderr, done.stdout + done.stderr)
    done = setup(bench, "--device", "ping360", "--port", "serial:/dev/ttyUSB0:115200", "--mount", "0,0,-0.4", "--near", "--output", "-")
    check("\nnear = 5.8 m\n" in done.stdout and "# A promise: that nothing" in done.stdout, done.stdout)
    tank = ("--device", "ping360", "--port", "serial:/dev/ttyUSB0:115200", "--range", "2")
    for more in ((), ("--near",), ("--near", "--current", "0.05")):
        short = setup(bench, *tank, *more, "--output", "-")
        check("near" not in short.stdout and "near is left out: it would be 3.4 m, beyond the range of 2 m" in short.stderr, short.stdout + short.stderr)
        checked = bench.run(SONARD, "--check", bench.write("short.conf", short.stdout))
        check(checked.returncode == 0, checked.stderr)
    promised = bench.write("near.conf", done.stdout.replace("#near", "near"))
    checked = bench.run(SONARD, "--check", promised)
    check(checked.returncode == 0 and "near" not in checked.stdout.replace(promised, ""), checked.stdout)
    done = setup(bench, "--device", "micron", "--port", "udp:192.168.2.2:9092", "--name", "bow", "--mount", "0.2,0,-0.1",
                 "--size", "1,0.5,0.4", "--range", "30", "--upside-down", "--output", "-")
    done = bench.run(SONARD, "--check", bench.write("all.conf", done.stdout))
    check(done.returncode == 0, done.stderr)


def accepted(bench):
    """Each device on each port and with each option at odd values: sonard accepts what is written; what it would not is refused in
    its own words. The gate has some of them, LONG=1 all."""
    devices = setup(bench, "--device", "?", "--output", "-").stderr.split("supported: ")[1].split()
    cases = [(device, port, ()) for device in devices for port in ODD_PORTS]
    cases += [(device, port, odd) for device in devices for odd in ODD_OPTIONS for port in ("serial:/dev/null:9600", "can:can0")]
    written = refusals = 0
    for device, port, odd in cases if os.environ.get("LONG") else random.Random(SEED).sample(cases, 50):
        done = setup(bench, "--device", device, "--port", port, *odd, "--output", "-")
        about = "%s %s %s: %d %s" % (device, port, odd, done.returncode, done.stderr)
        if done.returncode == 0:
            checked = bench.run(SONARD, "--check", bench.write("odd.conf", done.stdout))
            check(checked.returncode == 0, about + checked.stderr)
            written += 1
        else:
            check(done.returncode == 3 and done.stdout == "" and "nothing is written" in done.stderr, about)
            check("standard output:" in done.stderr and ": [sonar " in done.stderr, "without sonard's words: " + about)
            refusals += 1
    check(written > 0 and refusals > 0, "%d written, %d refused" % (written, refusals))


def drop_in(bench):
    """In the folder behind sonard.conf it wins over what stands there."""
    conf = bench.conf()
    os.mkdir(conf + ".d")
    done = setup(bench, "--device", "ping360", "--port", "/dev/null", "--name", "head", "--range", "7", "--output",
                 conf + ".d/50-setup.conf")
    check(done.returncode == 0, done.stderr)
    printed = bench.run(SONARD, "-c", conf, "--print").stdout
    check("range = 7 m" in printed and "port = serial:/dev/null:921600" in printed, printed)
    other = conf + ".d/60-other.conf"
    done = setup(bench, "--device", "micron", "--port", "/dev/null", "--name", "other", "--output", other)
    check(done.returncode == 3 and other + ":7: [sonar other] port = serial:/dev/null:115200: does not go with" in done.stderr, done.stderr)
    check("another serial port: each device needs its own" in done.stderr and not os.path.exists(other), done.stderr)
    link = bench.path("link.conf")
    shutil.copy(conf, link)
    os.symlink(conf + ".d", link + ".d")
    done = setup(bench, "--device", "micron", "--port", "/dev/null", "--name", "other", "--output", link + ".d/60-other.conf")
    check(done.returncode == 3 and "each device needs its own" in done.stderr, "behind a link: " + done.stderr)


def nothing_there(bench):
    """No answer: what was tried is told, and nothing is written."""
    leader, follower = pty.openpty()
    out = bench.path("none.conf")
    done = setup(bench, "--port", os.ttyname(follower), "--output", out)
    check(done.returncode == 2 and "no answer at 115200 or 921600 baud" in done.stderr, done.stderr)
    check("no sonar found at /dev/pts" in done.stderr and "Give --device to write" in done.stderr and not os.path.exists(out), done.stderr)
    os.close(leader)
    os.close(follower)
    port = free_port()
    udp = "udp:127.0.0.1:%d" % port
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as silent:
        silent.bind(("127.0.0.1", port))
        done = setup(bench, "--port", udp)
        check(done.returncode == 2 and "and no answer\n" in done.stderr and "is its bridge running" in done.stderr, done.stderr)
    done = setup(bench, "--port", udp)
    check(done.returncode == 2 and "nothing listens there" in done.stderr and "plug" not in done.stderr, done.stderr)
    taken = bench.write("taken.conf", "mine")
    done = setup(bench, "--device", "micron", "--port", "/dev/null", "--output", taken)
    check(done.returncode == 7 and "File exists; remove it first" in done.stderr, done.stderr)
    done = setup(bench, "--output", taken)
    check(done.returncode == 7 and "listening" not in done.stderr, "it was not said first: " + done.stderr)


def refused(bench):
    """Options that cannot be meant are said once, before anything is listened to; what cannot be opened, by what it is."""
    for words, status, wanted in ((("--device", "Ping360", "--port", "/dev/null"), 3, "no such device: Ping360"),
                                  (("--device", "micron", "--port", "serial:x"), 3, "as /dev/ttyUSB0:115200"),
                                  (("--port", "ttyUSB0"), 3, "must be a kind and an address"),
                                  (("--port", "udp:bluerov"), 3, "must be an address and a port number"),
                                  (("--device", "micron", "--port", "/dev/null", "--name", "a b"), 3, "--name: expected"),
                                  (("--range", "500"), 3, "0.75 to 200"),
                                  (("--device", "ping360", "--port", "/dev/null", "--range", "200"), 3, "ping360 takes range 0.75 to 50 m"),
                                  (("--device", "dronecan", "--port", "/dev/null"), 3, "it needs a CAN bus, as port = can:can0"),
                                  (("--device", "nmea2000", "--port", "/dev/null"), 3, "it needs a CAN bus, as port = can:can0"),
                                  (("--size", "1,0,0.5"), 3, "--size: expected 3 numbers from 0.1 to 50"),
                                  (("--mount", "99,0,0"), 3, "--mount: expected 3 numbers from -50 to 50"),
                                  (("--port", "/dev/null"), 2, "no sonar found at /dev/null; power, wiring, right port?"),
                                  (("--port", "can:can0"), 2, "serial lines, UDP and TCP only; give --device"),
                                  (("--port", bench.path("ttyUSB9")), 2, "no such port; find it with `ls /dev/serial/by-id`")):
        done = setup(bench, *words, "--output", "-")
        check(done.returncode == status and done.stderr.count(wanted) == 1, "%s: %d %s" % (words, done.returncode, done.stderr))
        check(("listening" in done.stderr) == (status == 2), "%s: %s" % (words, done.stderr))
        check(done.stdout == "", done.stdout)


def warns(bench):
    """A transducer outside of the vehicle, and an input at which nobody can be asked."""
    out = ("--output", "-")
    for more, outside in ((("--mount", "0.2,0,0", "--size", "0.5,0.4,0.3"), False), (("--mount", "0.4,0,0", "--size", "0.5,0.4,0.3"), True),
                          (("--mount", "0.1,0,0.2", "--size", "0.5,0.4,0.3"), True), (("--mount", "0.3,0,0.1"), False), (("--mount", "1.2,0,0"), True)):
        done = setup(bench, "--device", "micron", "--port", "/dev/null", *more, *out)
        check(done.returncode == 0 and ("outside of the vehicle" in done.stderr) == outside, "%s: %s" % (more, done.stderr))
        check("not a terminal" not in done.stderr, done.stderr)
    done = bench.run(SONARCTL, "setup", "--device", "micron", "--port", "/dev/null", *out)
    check(done.returncode == 0 and "standard input is not a terminal" in done.stderr, done.stderr)


def ports(bench):
    """A port that cannot be had: the last line says what to do."""
    leader, follower = pty.openpty()
    name = os.ttyname(follower)
    fcntl.flock(follower, fcntl.LOCK_EX)
    missing = bench.path("ttyUSB9")
    for port, wanted in ((name, "sudo fuser -v %s" % name), ("serial:%s:115200" % name, "another program has serial:"),
                         (missing, "ls /dev/serial/by-id")):
        done = setup(bench, "--port", port)
        last = done.stderr.splitlines()[-1]
        check(done.returncode == 2 and wanted in last, "%s: %d %s" % (port, done.returncode, done.stderr))
    os.close(leader)
    os.close(follower)


def drained(leader):
    """What was written to a terminal that nobody has open any more; closes it."""
    said = b""
    try:
        while more := os.read(leader, 65536):
            said += more
    except OSError:  # all of it is read
        os.close(leader)
    return said.decode()


def asked(out, keys):
    """What `setup` at a terminal returns and says to somebody who types `keys`."""
    leader, follower = pty.openpty()
    child = subprocess.Popen([SONARCTL, "setup", "--port", "/dev/null", "--output", out], stdin=follower,
                             stdout=follower, stderr=follower)
    os.close(follower)
    os.write(leader, keys)
    status = child.wait(30 * PATIENCE)
    return status, drained(leader)


def questions(bench):
    """At a terminal it asks; an empty line takes what stands in brackets, nonsense is asked again."""
    out = bench.path("asked.conf")
    status, said = asked(out, b"blueview\nping360\n0.3 0\n0.3 0 0.1\nja\nYes\n\n12\nsea\nHarbour\ny\n")
    check(status == 0, said)
    check("supported: micron" in said and "expected 3 numbers" in said and "expected y or n" in said and "expected pool" in said and "fast does the water go" in said, said)
    check("every obstacle within 3.2 m reach" in said, "not what is promised: " + said)
    with open(out, encoding="ascii") as f:
        text = f.read()
    for line in ("device = ping360", "mount = 0.3 0 0.1 m", "rotation = 180 0 0 deg", "range = 12 m", "radius = 0.287 m", "current = 0.3 m/s",
                 "port = serial:/dev/null:921600", "near = 3.2 m"):
        check("\n%s\n" % line in text, "no %s in %s" % (line, text))


def hangs_up(bench):
    """Who leaves before the last answer has not taken the defaults of the rest: nothing is written."""
    for keys in (b"\x04", b"ping360\n\x04", b"ping360\n0.3 0 0.1\n\n\n\x04", b"ping360\n0.3 0 0.1\n\n\n\n\x04", b"ping360\n0.3 0 0.1\n\n\n\n\n\x04"):
        out = bench.path("left.conf")
        status, said = asked(out, keys)
        check(status in (2, 7) and not os.path.exists(out), "%s: %d %s" % (keys, status, said))
    check(status == 7 and "nothing is written" in said, said)


run([("ping360", found("ping360_sim", "ping360")),
     ("ping360_that_wants_autobaud", found("ping360_sim", "ping360", "--strict-autobaud")),
     ("micron", found("micron_sim", "micron", quiet=True)),
     ("ping1d", found("ping1d_sim", "ping1d")),
     ("ping1d_with_old_firmware", found("ping1d_sim", "ping1d", "--old", "1")),
     ("options", options), ("accepted", accepted), ("drop_in", drop_in), ("nothing_there", nothing_there), ("refused", refused), ("warns", warns), ("ports", ports), ("questions", questions),
     ("hangs_up", hangs_up)], parallel=2,
    gate=("options", "accepted", "drop_in", "nothing_there", "refused", "warns", "ports", "questions", "hangs_up"))
