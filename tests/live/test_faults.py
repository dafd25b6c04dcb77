#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Faults of the port and the end of the daemon, with a real terminal. What the line and the head can do wrong is in
tests/unit/daemon/test_rig_faults.c."""
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


# ---- the port goes and comes ----

def unplug(bench):
    """The adapter is pulled and put back; a client that watches all the while is not dropped."""
    sim = bench.sim()
    bench.conf()
    client = bench.sonard().client()
    client.call("watch", method="sectors", rate_hz=10)
    wait_running(client)
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
    sent = client.call("status")["server"]
    check(sent["clients_cut"] == 0 and sent["clients_total"] == 1, "the client was cut: %s" % sent)
    seen = client.notifications
    whole = [n for n in seen if n["method"] == "sectors" and len(n["result"]["sectors"]) == 72]
    check(seen and len(whole) == len(seen), "%d of %d notifications are broken" % (len(seen) - len(whole), len(seen)))


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
    check("cannot be opened (not plugged in, or taken by brltty? see devices/serial.md): No such file" in sensor["port_error"], "error is %s" % sensor["port_error"])
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
    ("unplug", unplug),
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
