#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""CAN end to end: virtual sonars on virtual buses, the real daemon, what goes wrong with a bus, and a Ping360 behind
ISO-TP and behind a byte-stream gateway. Needs root and a kernel with CAN."""
import itertools
import os
import signal
import subprocess
import sys
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "live"))
from lib import BUILD, Process, Sim, check, note, pings_until, run, until  # noqa: E402
from twin import micron  # noqa: E402

TESTS = os.path.join(BUILD, "tests")
numbers = itertools.count()
alone = threading.Lock()  # an emulated CPU needs 0.5 ms per frame: two streams of bytes at once, and answers come too late


def ip(*arguments):
    subprocess.run(["ip", "link"] + list(arguments), check=True)


def bus(fd=True):
    """A virtual bus of this case alone; its name."""
    name = "vcan%d" % (100 + next(numbers))
    make(name, fd)
    return name


def make(name, fd=True):
    ip("add", name, "type", "vcan")
    ip("set", name, "mtu", "72" if fd else "16")
    ip("set", name, "up")


class CanSim(Sim):
    def __init__(self, bench, *arguments):
        super().__init__(bench, "can_sim%d" % len(bench.processes), list(arguments), os.path.join(TESTS, "can_sim"))
        bench.processes.append(self)


def start(bench, device, port, **sonar):
    """sonard with one sonar; a client of it."""
    keys = {"device": device, "port": port, "range": "50 m"}
    if device == "ping360":
        keys["mode"] = "auto"
    keys.update(sonar)
    bench.conf(sonar=keys)
    return bench.sonard().client()


def running(client):
    until(lambda: client.sensor()["state"] == "running", "the sonar to run")
    pings_until(client, 3)


def row(client):
    return client.call("image")["rows"][0]


def check_near(value, want, tolerance, what):
    check(value is not None and abs(value - want) <= tolerance, "%s is %s, want %s" % (what, value, want))


# ---- devices ----

def dronecan(bench, *options):
    name = bus()
    CanSim(bench, "--dronecan", "42", "--sensor", "3", "--range", "7.25", "--load", "300", *options, name)
    client = start(bench, "dronecan", "can:" + name)
    running(client)
    pings_until(client, 20)
    sensor = client.sensor()
    check(sensor["what"] == "DroneCAN node 42 sensor 3", sensor["what"])
    check(all(sensor[key] == 0 for key in ("garbage_bytes", "bad_checksum", "bad_frame", "lost_frames", "port_lost")),
          str(sensor))
    check_near(row(client)["echo_m"], 7.25, 0.01, "the echo")
    record = 72 if "--fd" in options else 16
    frames = 1 if "--fd" in options else 3
    strangers = sensor["bytes_in"] // record - frames * sensor["frames"]
    check(strangers <= frames, "%d frames of others came through the filter" % strangers)


def dronecan_faults(bench):
    name = bus()
    sim = CanSim(bench, "--dronecan", "42", "--rate", "20", name)
    client = start(bench, "dronecan", "can:" + name)
    running(client)
    for command, counters in (("drop 3", {"lost_frames": 3, "garbage_bytes": 1}),
                              ("corrupt 2", {"lost_frames": 2, "bad_checksum": 2}),
                              ("reorder 2", {"lost_frames": 2, "garbage_bytes": 1}), ("duplicate 5", {})):
        before = client.sensor()
        sim.command(command)
        # A daemon that was held up has pings waiting from before the command: they must not count as those after it.
        until(lambda: client.sensor()["lost_frames"] >= before["lost_frames"] + counters.get("lost_frames", 0), command)
        pings_until(client, 12)
        after = client.sensor()
        for key in ("lost_frames", "bad_checksum", "bad_frame"):
            check(after[key] - before[key] == counters.get(key, 0), "%s: %s grew by %d" % (command, key,
                                                                                          after[key] - before[key]))
        check(after["garbage_bytes"] - before["garbage_bytes"] >= counters.get("garbage_bytes", 0), command)
        check(after["pings"] - before["pings"] <= after["frames"] - before["frames"], command)
    sim.command("silent 4")
    until(lambda: client.sensor()["state"] == "silent", "the silence to be noticed")
    running(client)


def dronecan_readings(bench):
    name = bus()
    sim = CanSim(bench, "--dronecan", "42", "--rate", "20", name)
    client = start(bench, "dronecan", "can:" + name)
    running(client)
    sim.command("too_close 100000")
    frames = client.sensor()["frames"]
    until(lambda: client.sensor()["frames"] > frames + 2, "messages")
    until(lambda: row(client)["state"] == "blind", "'too close' to be a ping that cannot tell")
    sim.command("too_close 0")
    sim.command("too_far 100000")
    until(lambda: row(client)["state"] == "silent", "'too far' to be a ping without echo")
    sim.command("too_far 0")
    until(lambda: row(client)["state"] == "echo", "an echo")


def dronecan_chosen(bench):
    name = bus()
    CanSim(bench, "--dronecan", "42", "--sensor", "1", "--range", "4", name)
    CanSim(bench, "--dronecan", "43", "--sensor", "1", "--range", "8", name)
    CanSim(bench, "--dronecan", "43", "--sensor", "2", "--range", "16", name)
    client = start(bench, "dronecan", "can:" + name, node=43, sensor_id=1)
    running(client)
    pings_until(client, 20)
    check(client.sensor()["what"] == "DroneCAN node 43 sensor 1", client.sensor()["what"])
    check_near(row(client)["echo_m"], 8, 0.01, "the echo")


def nmea2000(bench):
    name = bus(fd=False)
    sim = CanSim(bench, "--nmea2000", "35", "--nmea2000-rate", "10", "--range", "12.34", "--load", "300", name)
    client = start(bench, "nmea2000", "can:" + name, node=35)
    running(client)
    sensor = client.sensor()
    check(sensor["what"] == "NMEA 2000 address 35", sensor["what"])
    check(sensor["bytes_in"] == 16 * sensor["frames"], "frames of others came through the filter")
    check_near(row(client)["echo_m"], 12.34, 0.01, "the echo")
    sim.command("unavailable 100000")
    until(lambda: row(client)["state"] == "blind", "'not available' to be a ping that cannot tell")
    check(row(client)["echo_m"] is None, "'not available' was taken for a depth")
    sim.command("unavailable 0")
    until(lambda: row(client)["state"] == "echo", "an echo")


def recorded(bench):
    """What was recorded replays to the same pings."""
    name = bus()
    sim = CanSim(bench, "--dronecan", "42", "--rate", "50", "--speed", "0.5", "--noise", "0.2", name)
    folder = bench.path("captures")
    bench.conf(sonar={"device": "dronecan", "port": "can:" + name}, record={"directory": folder})
    daemon = bench.sonard("--answers", bench.path("live"))
    client = daemon.client()
    pings_until(client, 60)
    sim.stop()
    daemon.stop()
    capture = os.path.join(folder, os.listdir(folder)[0])
    replay = bench.run(os.path.join(BUILD, "sonard"), "--replay", capture, "--answers", bench.path("again"), "--socket",
                       "none")
    check(replay.returncode == 0, replay.stderr)
    live, again = ([line for line in open(bench.path(file)) if '"event":"turn"' in line] for file in ("live", "again"))
    check(len(live) >= 60 and len(live) == len(again), "%d pings live, %d in the replay" % (len(live), len(again)))


# ---- the bus ----

def bus_state(bench):
    name = bus()
    sim = CanSim(bench, "--dronecan", "42", name)
    client = start(bench, "dronecan", "can:" + name)
    running(client)
    for command, state in (("warning", "warning"), ("passive", "passive"), ("active", "up")):
        sim.command("error " + command)
        until(lambda: client.sensor()["bus"]["state"] == state, "the bus to be " + state)
    told = client.sensor()["bus"]
    check(told["tx_errors"] == 11 and told["rx_errors"] == 130 and told["error_frames"] == 3, str(told))
    check(client.sensor()["garbage_bytes"] == 0 and client.sensor()["reconnects"] == 0, "error frames were taken for data")
    for command, counter in (("busoff", "bus_offs"), ("restarted", "restarts")):
        before = client.sensor()
        sim.command("error " + command)
        until(lambda: client.sensor()["reconnects"] == before["reconnects"] + 1, command)
        check(client.sensor()["bus"][counter] == 1, str(client.sensor()["bus"]))
        running(client)
    log = bench.processes[-1].log()
    check("the CAN bus is off" in log, "bus-off is not in the log")


def no_carrier(bench):
    """An interface without carrier, as one is whose controller is bus-off."""
    ip("add", "vx0", "type", "vxcan", "peer", "name", "vx1")
    ip("set", "vx0", "up")
    ip("set", "vx1", "up")
    sim = CanSim(bench, "--dronecan", "42", "vx1")
    client = start(bench, "dronecan", "can:vx0")
    running(client)
    sim.expected = 2  # its bus is taken away
    ip("del", "vx1")
    until(lambda: client.sensor()["state"] == "no port", "the loss")
    ip("add", "vx0", "type", "vxcan", "peer", "name", "vx1")
    ip("set", "vx0", "up")
    until(lambda: "not connected" in client.sensor().get("port_error", ""), "the missing carrier to be told")
    check(client.sensor()["bus"]["state"] == "off", str(client.sensor()["bus"]))
    ip("set", "vx1", "up")
    CanSim(bench, "--dronecan", "42", "vx1")
    running(client)


def controller(bench):
    """A real driver's controller with a bit rate, its other end on the same wire."""
    for name in ("can0", "can1"):
        ip("set", name, "type", "can", "bitrate", "500000", "restart-ms", "100")
        ip("set", name, "up")
    CanSim(bench, "--dronecan", "42", "--range", "7.25", "can1")
    client = start(bench, "dronecan", "can:can0")
    running(client)
    check_near(row(client)["echo_m"], 7.25, 0.01, "the echo")
    ip("set", "can0", "down")
    until(lambda: client.sensor()["bus"]["state"] == "down", "the interface to be told as down")
    ip("set", "can0", "up")
    running(client)


def comes_and_goes(bench):
    name = bus()
    sim = CanSim(bench, "--dronecan", "42", name)
    client = start(bench, "dronecan", "can:" + name)
    running(client)
    ip("set", name, "down")
    until(lambda: "is down" in client.sensor().get("port_error", ""), "the interface to be told as down")
    check(client.sensor()["state"] == "no port" and client.sensor()["bus"]["state"] == "down", str(client.sensor()))
    ip("set", name, "up")
    running(client)
    ip("del", name)
    until(lambda: "no such interface" in client.sensor().get("port_error", ""), "the interface to be told as missing")
    sim.expected = 2  # its bus is taken away
    make(name)
    CanSim(bench, "--dronecan", "42", name)
    running(client)
    check(client.sensor()["reconnects"] == 2, "%d reconnects" % client.sensor()["reconnects"])


def comes_late(bench):
    client = start(bench, "dronecan", "can:late0")
    until(lambda: "no such interface" in client.sensor().get("port_error", ""), "the missing interface to be told")
    make("late0")
    CanSim(bench, "--dronecan", "42", "late0")
    running(client)


def overflow(bench):
    name = bus()
    CanSim(bench, "--dronecan", "42", "--rate", "1000", name)
    client = start(bench, "dronecan", "can:" + name)
    running(client)
    daemon = bench.processes[-1].process
    daemon.send_signal(signal.SIGSTOP)
    time.sleep(3)
    daemon.send_signal(signal.SIGCONT)
    until(lambda: client.sensor()["port_lost"] > 0, "the overflow of the receive queue to be counted")
    note("%d frames lost" % client.sensor()["port_lost"])
    running(client)


def clock_set(bench):
    """The computer's clock is set, forward and back: what comes in is dated as before."""
    name = bus()
    CanSim(bench, "--dronecan", "42", "--rate", "20", name)
    client = start(bench, "dronecan", "can:" + name)
    running(client)
    for by_s in (3600, -7200, 3600):
        time.clock_settime(time.CLOCK_REALTIME, time.time() + by_s)
        running(client)
        age_s = client.sensor()["last_ping_age_s"]
        check(0 <= age_s < 2, "the newest ping is %g s old after the clock was set" % age_s)
        check(client.call("sectors")["t_unix"] - time.time() < 1, "t_unix is not the clock's")


def kernel_time(bench):
    """A daemon that was held up still dates frames as they came in."""
    name = bus()
    sim = CanSim(bench, "--dronecan", "42", "--rate", "20", name)
    folder = bench.path("captures")
    bench.conf(sonar={"device": "dronecan", "port": "can:" + name}, record={"directory": folder})
    daemon = bench.sonard()
    client = daemon.client()
    running(client)
    daemon.process.send_signal(signal.SIGSTOP)
    time.sleep(2.5)
    daemon.process.send_signal(signal.SIGCONT)
    running(client)
    sim.stop()
    daemon.stop()
    csv = bench.run(os.path.join(BUILD, "sonarctl"), "capture", "export", "--csv",
                    os.path.join(folder, os.listdir(folder)[0]))
    times = [float(line.split(",")[1]) for line in csv.stdout.splitlines() if line.startswith("/head/rx,")]
    gaps = [b - a for a, b in zip(times, times[1:])]
    check(len(gaps) > 20 and max(gaps) < 1.5, "there is a gap of %s s between the frames" % max(gaps or [None]))


# ---- bytes over CAN ----

def bridged(bench, kind, option="", receive="702"):
    """A gateway between the bench's serial line and a bus of its own; the bus and sonard's port."""
    name = bus()
    bridge = Process(bench, "bridge", [os.path.join(TESTS, "can_bridge"), "serial:%s:4000000" % bench.port_path,
                                       "%s:%s:%s:701%s" % (kind, name, receive, option)])
    bridge.expected = 1  # the bus is taken away from it
    bench.processes.insert(0, bridge)
    return name, "%s:%s:701:%s%s" % (kind, name, receive, option)


def carried_micron(bench):
    """The other protocol of bytes: its handshake and a sector's echoes."""
    micron(bench)
    name, port = bridged(bench, "isotp")
    client = start(bench, "micron", port, range="10 m", step="1.8 deg")
    running(client)
    pings_until(client, 60)
    sensor = client.sensor()
    check(sensor["garbage_bytes"] == sensor["bad_frame"] == sensor["restarts"] == 0, str(sensor))
    check(sensor["timeouts"] <= 1, "%d answers were not waited for" % sensor["timeouts"])  # the wait for a sign of life
    ip("set", name, "down")
    until(lambda: client.sensor()["state"] == "no port", "the loss of the interface")


def carried(bench, kind, option="", receive="702", mode="transmit"):
    bench.sim(quick=False)  # a bus has no room for a head that is faster than real ones
    name, port = bridged(bench, kind, option, receive)
    client = start(bench, "ping360", port, range="1 m", mode=mode)
    running(client)
    pings_until(client, 30)
    sensor = client.sensor()
    check(sensor["bus"]["state"] == "up", str(sensor["bus"]))
    note("%s: %s, %s" % (kind + option, {key: sensor[key] for key in ("frames", "garbage_bytes", "bad_checksum",
                                                                      "lost_frames", "timeouts", "port_lost")}, sensor["bus"]))
    check(sensor["garbage_bytes"] == sensor["bad_checksum"] == 0, "bytes were lost or changed on the way")
    ip("set", name, "down")
    until(lambda: client.sensor()["state"] == "no port", "the loss of the interface")


def silent_peer(bench):
    """Nobody answers to ISO-TP: told as silence, and the port stays."""
    name = bus()
    client = start(bench, "ping360", "isotp:%s:701:702" % name, range="3 m")
    until(lambda: client.sensor()["state"] == "silent", "the silence to be noticed")
    check(client.sensor()["reconnects"] == 0, "the port was given up")


def one_by_one(function, *arguments, **named):
    def case(bench):
        with alone:
            function(bench, *arguments, **named)
    return case


cases = [
    ("can_dronecan", dronecan),
    ("can_dronecan_fd", lambda bench: dronecan(bench, "--fd")),
    ("can_dronecan_faults", dronecan_faults),
    ("can_dronecan_readings", dronecan_readings),
    ("can_dronecan_node_and_sensor", dronecan_chosen),
    ("can_nmea2000", nmea2000),
    ("can_recorded_and_replayed", recorded),
    ("can_bus_state", bus_state),
    ("can_no_carrier", no_carrier),
    ("can_controller", controller),
    ("can_interface_down_and_deleted", comes_and_goes),
    ("can_interface_late", comes_late),
    ("can_receive_overflow", overflow),
    ("can_kernel_time", one_by_one(kernel_time)),  # not while the clock is being set: no stamp is believed then
    ("can_clock_set", one_by_one(clock_set)),
    ("can_isotp_ping360", one_by_one(carried, "isotp", mode="request")),
    ("can_isotp_fd_ping360", one_by_one(carried, "isotp", ":fd", "18DAF101")),
    ("can_isotp_padded_ping360", one_by_one(carried, "isotp", ":pad", mode="request")),
    ("can_isotp_micron", one_by_one(carried_micron)),
    ("can_isotp_silent_peer", silent_peer),
    ("can_stream_ping360", one_by_one(carried, "canstream")),
]

if __name__ == "__main__":
    run(cases, parallel=4)
