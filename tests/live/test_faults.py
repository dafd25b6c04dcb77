#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Faults of the line, the head and the port: pings go on afterwards, the right counter says what happened, and a
client that watches all the while is not dropped."""
import contextlib
import os
import pty
import signal
import statistics
import subprocess
import time

from lib import PATIENCE, SIM, check, note, pings_until, run, until

COUNTERS = ("garbage_bytes", "bad_checksum", "bad_frame", "lost_frames", "nacks", "timeouts", "restarts",
            "reconnects", "dropped")


def counters(client):
    sensor = client.sensor()
    return {key: sensor[key] for key in COUNTERS}


def wait_running(client, limit_s=20):
    until(lambda: client.sensor()["state"] == "running", "the sonar to run", limit_s)
    pings_until(client, 3)


# ---- one fault after the other ----

# What to tell the sonar, which counters must grow by how much at least, which others may grow, in each mode.
FAULTS = {
    "transmit": (
        ("drop 3", {"lost_frames": 3}, ()),
        ("corrupt 2", {"bad_checksum": 2, "lost_frames": 2}, ("garbage_bytes",)),
        ("short 2", {"garbage_bytes": 1, "lost_frames": 2}, ("bad_checksum",)),
        ("garbage 500", {"garbage_bytes": 490}, ("bad_checksum",)),
        ("split on", {}, ()),
        ("split off", {}, ()),
        ("stall 1", {}, ()),
        ("silent 2.5", {"timeouts": 1, "restarts": 1}, ("lost_frames",)),
        ("flood 0.5", {"garbage_bytes": 1000}, ("bad_checksum", "lost_frames", "timeouts", "restarts")),
        ("reboot", {"timeouts": 1, "restarts": 1}, ("lost_frames",)),
        ("nack 1+reboot", {"nacks": 1}, ("timeouts", "restarts", "lost_frames")),
    ),
    "request": (
        ("drop 3", {"lost_frames": 3, "timeouts": 3}, ()),
        ("corrupt 2", {"bad_checksum": 2, "lost_frames": 2}, ("garbage_bytes", "timeouts")),
        ("short 2", {"garbage_bytes": 1, "lost_frames": 2}, ("bad_checksum", "timeouts")),
        ("garbage 500", {"garbage_bytes": 490}, ("bad_checksum",)),
        ("split on", {}, ()),
        ("split off", {}, ()),
        ("nack 2", {"nacks": 2, "lost_frames": 2}, ("timeouts",)),
        ("stall 1", {"timeouts": 1, "lost_frames": 1}, ("restarts",)),
        ("silent 2.5", {"timeouts": 1, "lost_frames": 1}, ("restarts",)),
        ("flood 0.5", {"garbage_bytes": 1000}, ("bad_checksum", "lost_frames", "timeouts", "restarts")),
        ("reboot", {}, ("timeouts", "lost_frames", "restarts")),
    ),
}


def play(sim, client, fault, grow, may_grow):
    """Faults of what the counters said of one fault of the sonar; empty: none."""
    before = counters(client)
    for command in fault.split("+"):
        sim.command(command)
    until(lambda: all(counters(client)[key] >= before[key] + n for key, n in grow.items()),
          "%s: of %s the counters are %s, were %s" % (fault, grow, counters(client), before))
    if fault.startswith(("silent", "stall", "flood")):
        time.sleep(float(fault.split()[1]))
    wait_running(client)
    pings_until(client, 20)
    after = counters(client)
    grown = {key: after[key] - before[key] for key in COUNTERS if after[key] > before[key]}
    note("%-14s %s" % (fault, grown))
    exact = ("lost_frames",) if fault.startswith(("drop", "corrupt", "short")) else ()
    return ["%s: %s grew by %d" % (fault, key, n) for key, n in grown.items()
            if (key not in grow and key not in may_grow) or (key in exact and n != grow[key])]


def faults(bench, mode):
    sim = bench.sim("--lag", "0")
    bench.conf(sonar={"mode": mode})
    client = bench.sonard().client()
    client.call("watch", method="sectors", rate_hz=10)
    wait_running(client)
    wrong = []
    for fault in FAULTS[mode]:
        # On a busy machine something may really be late: only what happens every time is the daemon's.
        tries = [play(sim, client, *fault)]
        while tries[-1] and len(tries) < 3:
            tries.append(play(sim, client, *fault))
        wrong += tries[-1]
    check(not wrong, "; ".join(wrong))
    sim.command("range 5")
    until(lambda: abs(client.sensor()["range_m"] - 5) < 0.1, "pings of 5 m range")
    sim.command("range 0")
    until(lambda: abs(client.sensor()["range_m"] - 10) < 0.1, "pings of 10 m range again")
    unplug(bench, sim, client)
    sent = client.call("status")["server"]
    check(sent["clients_cut"] == 0 and sent["clients_total"] == 1, "the client was cut: %s" % sent)
    seen = client.notifications
    check(len(seen) >= 50, "the watch sent only %d notifications" % len(seen))
    whole = [n for n in seen if n["method"] == "sectors" and len(n["result"]["sectors"]) == 72]
    check(len(whole) == len(seen), "%d notifications are broken" % (len(seen) - len(whole)))


def unplug(bench, sim, client):
    log = bench.processes[1].log
    took = []
    while len(took) < 3 and (not took or min(took) > 2):
        before, warnings = counters(client), log().count("warning:")
        sim.command("unplug")
        until(lambda: client.sensor()["state"] == "no port", "the loss of the port")
        time.sleep(2.5)
        sensor = client.sensor()
        check(bench.port_path in sensor.get("port_error", ""), "status does not name the port: %s" % sensor)
        new = log().count("warning:") - warnings
        check(new == 1, "%d warnings while the port is away, not 1" % new)
        sim.command("plug")
        begin, pings = time.monotonic(), client.sensor()["pings"]
        until(lambda: client.sensor()["pings"] > pings, "a ping after the plug")
        took.append(time.monotonic() - begin)
        until(lambda: client.sensor()["state"] == "running", "the sonar to run")
        after = client.sensor()
        check("port_error" not in after, "status still has an error: %s" % after)
        check(after["reconnects"] == before["reconnects"] + 1, "reconnects: %d" % after["reconnects"])
    note("pings again %.2f s after the plug" % min(took))
    check(min(took) <= 2 * PATIENCE, "pings again only after %s s" % took)


# ---- what one lost frame costs ----

def gap_s(bench, sim, client):
    """The gap between two transmissions across one lost frame, beyond the ordinary gap."""
    pings_until(client, 10)
    n = len(bench.truth())
    sim.command("drop 1")
    pings_until(client, 6)
    times = [ping["t_ns"] * 1e-9 for ping in bench.truth()[n - 10:]]
    gaps = [b - a for a, b in zip(times, times[1:])]
    return max(gaps) - statistics.median(gaps)


def lost_frame(bench, mode, step):
    sim = bench.sim(truth=True, quick=False)
    bench.conf(sonar={"mode": mode, "step": step}, baud=921600)
    client = bench.sonard().client()
    wait_running(client)
    lost = client.sensor()["lost_frames"]
    gaps = [gap_s(bench, sim, client) for _ in range(3)]
    note("one lost frame, %s, step %s: scanning stands still for %s ms beyond an ordinary gap"
         % (mode, step, ", ".join("%.0f" % (1e3 * gap) for gap in gaps)))
    check(client.sensor()["lost_frames"] >= lost + 3, "lost frames are not counted")
    check(min(gaps) <= 0.2, "one lost frame costs %s s" % gaps)


# ---- the port ----

def absent(bench):
    """No port at the start: said once; runs as soon as it is there."""
    bench.conf()
    daemon = bench.sonard()
    client = daemon.client()
    time.sleep(1.5)
    sensor = client.sensor()
    check(sensor["state"] == "no port", "state is %s" % sensor["state"])
    check("cannot be opened: No such file" in sensor["port_error"], "error is %s" % sensor["port_error"])
    check(daemon.log().count("warning:") == 1, "not one warning")
    check(client.call("status")["data"] == "no data from the sonar", "status has data")
    bench.sim()
    wait_running(client)


def not_a_tty(bench):
    """A port that is an ordinary file, then a folder, then the sonar."""
    bench.conf()
    bench.write("port", "no terminal")
    client = bench.sonard().client()
    until(lambda: "not a serial port" in client.sensor().get("port_error", ""), "the file to be refused")
    os.remove(bench.port_path)
    os.mkdir(bench.port_path)
    until(lambda: "Is a directory" in client.sensor()["port_error"], "the folder to be refused")
    os.rmdir(bench.port_path)
    bench.sim()
    wait_running(client)
    check(open(bench.write("other", "unharmed"), encoding="ascii").read() == "unharmed", "the file was written to")


def second(bench):
    """A second sonard on the same port, with a socket of its own, is refused and does no harm."""
    bench.sim()
    bench.conf()
    client = bench.sonard().client()
    wait_running(client)
    before = counters(client)
    own = bench.path("second.sock")
    other = bench.sonard("--socket", own)
    other.socket_path = own
    status = other.client().call("status")["sensors"][0]
    check(status["state"] == "no port", "the second has the port: %s" % status)
    check("in use by another process" in status["port_error"], "the second says: %s" % status["port_error"])
    check("in use by another process" in other.log(), "the second does not log it")
    pings_until(client, 30)
    after = counters(client)
    check(after == before, "the first was disturbed: %s, before %s" % (after, before))
    third = bench.sonard("--socket", bench.socket_path)
    third.expected = 1
    check(third.wait() == 1, "a second sonard on the same socket runs")
    check(bench.socket_path in third.log() and "another" in third.log(), "its message: %s" % third.log())
    check(client.sensor()["state"] == "running", "the first was disturbed by the third")


# ---- the end ----

def stop_s(bench, silent):
    sim, daemon = bench.sim(), bench.sonard()
    client = daemon.client()
    wait_running(client)
    if silent:
        sim.command("silent 30")
    begin = time.monotonic()
    status = daemon.stop()
    took = time.monotonic() - begin
    check(status == 0, "exit status %s" % status)
    check(not os.path.exists(bench.socket_path), "the socket is left behind")
    says = sim.command("status")
    check("idle" in says and "auto-transmit" not in says, "the head still works: %s" % says)
    sim.stop()
    return took


def stop(bench, silent):
    """SIGTERM: the head is told to stop its motor, also when it does not answer."""
    bench.conf()
    took = []
    while len(took) < 3 and (not took or min(took) > 1):
        took.append(stop_s(bench, silent))
    note("SIGTERM%s: ended after %.2f s" % (" with a head that is silent" if silent else "", min(took)))
    check(min(took) <= 1 * PATIENCE, "it took %s s" % took)


def in_background(bench):
    """A head in the background of a shell goes on when somebody types the next command: that line is the shell's."""
    shell, terminal = pty.fork()
    if shell == 0:
        head = subprocess.Popen([SIM, "--link", bench.port_path], stdout=subprocess.DEVNULL, process_group=0)
        print(head.pid, flush=True)
        _, how = os.waitpid(head.pid, os.WUNTRACED)
        os._exit(1 if os.WIFSTOPPED(how) else 0)
    head = int(os.read(terminal, 100))
    try:
        bench.conf()
        client = bench.sonard().client()
        wait_running(client)
        os.write(terminal, b"status\n")
        pings_until(client, 20)
        check(os.waitpid(shell, os.WNOHANG)[0] == 0, "the head was stopped, or ended")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(head, signal.SIGKILL)
        os.close(terminal)


cases = [
    ("faults_transmit", lambda bench: faults(bench, "transmit")),
    ("faults_request", lambda bench: faults(bench, "request")),
    ("lost_frame_request", lambda bench: lost_frame(bench, "request", "0.9 deg")),
    ("lost_frame_request_10_gradians", lambda bench: lost_frame(bench, "request", "9 deg")),
    ("lost_frame_transmit", lambda bench: lost_frame(bench, "transmit", "0.9 deg")),
    ("port_absent_at_start", absent),
    ("port_not_a_tty", not_a_tty),
    ("second_daemon", second),
    ("stop", lambda bench: stop(bench, False)),
    ("stop_silent_head", lambda bench: stop(bench, True)),
    ("in_background", in_background),
]

run(cases, parallel=4)
