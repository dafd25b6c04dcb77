#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Recording a live sonar and replaying the capture: the same answers, also after the power went."""
import glob
import os
import signal
import threading
import time

from lib import PATIENCE, SONARD, check, expect_refusal, jump, note, pings_until, run, until

TURN = 200  # pings of a full circle at 1.8 degrees


class Voyage(threading.Thread):
    """Moves the vehicle, in the water and for the daemon, ten times a second: it turns slowly and drifts ahead."""

    def __init__(self, sim, daemon):
        super().__init__(daemon=True)
        self.sim = sim
        self.client = daemon.client()
        self.steps = self.rests = 0
        self.ended = threading.Event()

    def step(self):
        self.steps += 1
        north, yaw = (k * (self.steps - self.rests) for k in (0.01, 0.5))
        self.sim.command("pose %g 0 0 %g" % (north, yaw))
        self.client.call("pose", attitude_deg=[0, 0, yaw], position_m=[north, 0, 0], t_unix=time.time())

    def run(self):
        while not self.ended.wait(0.1):
            self.step()

    def end(self):
        """Comes to rest, so that the answers are the same for as long as the last pose counts."""
        self.ended.set()
        self.join()
        for self.rests in (1, 2, 3):
            time.sleep(0.1)
            self.step()


def start(bench, directory, voyage=True, step="1.8 deg"):
    sim = bench.sim(truth=True)
    bench.conf(sonar={"step": step}, answers={"look_ahead": "200 m"}, pose={"max_age": "1 min"})
    daemon = bench.sonard("--record", directory)
    client = daemon.client()
    if not voyage:
        return sim, daemon, client, None
    trip = Voyage(sim, daemon)
    trip.step()
    trip.start()
    return sim, daemon, client, trip


def only_capture(directory):
    files = glob.glob(os.path.join(directory, "*.mcap"))
    check(len(files) == 1, "captures: %s" % files)
    return files[0]


def shape(sectors):
    """What must not differ between live and replay: the ages do, for they are asked at another moment."""
    return [(s["azimuth_deg"], s["state"], s["range_m"], s["free_to_m"]) for s in sectors]


WATER_GRID_M = 1 / 16


def same(live, replay):
    """Equal, but for the last digit, and for free water one step of the ranges at which it is divided (grid/water/decide.h): the
    time that an answer tells is rounded, and a capture's times are whole nanoseconds of another clock."""
    def equal(a, b, off):
        return a == b or (None not in (a, b) and not isinstance(a, str) and abs(a - b) <= off)
    differing = [(a, b) for a, b in zip(shape(live), shape(replay))
                 if not all(map(equal, a, b, (0, 0, 0.001, WATER_GRID_M + 0.001)))]
    check(not differing, "live and replay differ: %s" % differing[:5])


def replay(bench, capture, *arguments, status=0):
    result = bench.run(SONARD, "--replay", capture, "--socket", "none", *arguments)
    check(result.returncode == status, "replay ends with %d: %s" % (result.returncode, result.stderr[-500:]))
    return result


def answers(bench, capture, name, *arguments):
    out = bench.path(name)
    replay(bench, capture, "--answers", out, *arguments)
    with open(out, "rb") as f:
        return f.read()


def pings_of(bench, capture):
    """Ping lines of the exported capture."""
    result = bench.sonarctl("capture", "export", "--csv", capture)
    return sum(1 for line in result.stdout.splitlines() if line[:1].isdigit())


def when_silent(sim, client):
    """The sectors in body and ned, the pings, and the record, after the last ping: of one state of the head, which counts as
    offline after 1 s."""
    sim.command("silent 3600")
    while True:
        before = client.sensor()
        told = [client.call("sectors", frame=frame) for frame in ("body", "ned")]
        after = client.sensor()
        if all(after[key] == before[key] for key in ("pings", "state")):
            return told, after["pings"], client.call("status")["record"]


def same_answers(bench):
    """A replay has at any time the sectors that were answered live then, also after a silence and in one; test_rig_replay has it
    to the bit, and tests/voyage/test_record.py with any number of threads."""
    directory = bench.path("captures")
    sim, daemon, client, voyage = start(bench, directory)
    pings_until(client, TURN + 20)
    voyage.end()
    sim.command("silent 3600")
    until(lambda: client.sensor()["state"] != "running", "the head is missed")
    offline = [client.call("sectors", frame=frame) for frame in ("body", "ned")]
    sim.command("silent 0")
    pings_until(client, 20)
    told, pings, record = when_silent(sim, client)
    check(record["recording"] and record["lost_messages"] == 0 and record["error"] == "", "record: %s" % record)
    daemon.stop()
    capture = only_capture(directory)
    check(record["path"] == capture, "status names %s" % record["path"])

    info = bench.sonarctl("capture", "info", capture)
    check(info.returncode == 0, "capture info: %s" % info.stderr)
    for word in ("/head/rx", "/head/tx", "/pose", "sonard.conf"):
        check(word in info.stdout, "capture info does not tell %s" % word)
    kept = pings_of(bench, capture)
    check(kept == pings, "%d pings in the capture, %d live" % (kept, pings))

    stayed = bench.sonard("--replay", capture, "--stay", conf=False)
    for live in offline + told:
        now = stayed.client().call("status")
        client = jump(stayed, live["t_unix"] - (now["t_unix"] - now["replay"]["position_s"]), pause="yes")
        same(live["sectors"], client.call("sectors", frame=live["frame"])["sectors"])
    blocked = sum(s["state"] == "blocked" for s in told[0]["sectors"])
    check(blocked >= 60, "only %d sectors blocked" % blocked)
    check(client.call("status")["pose"]["count"] == voyage.steps, "not all poses were replayed")


def killed(bench):
    """kill -9 while recording: what is on the disk can be read and replayed, and is nearly all."""
    directory = bench.path("captures")
    # A turn of few pings: all of it would have room in one chunk, so what is there was written because of its age.
    _, daemon, client, voyage = start(bench, directory, step="3.6 deg")
    pings_until(client, 150)
    voyage.end()
    pings_until(client, 1)
    live = client.sensor()["pings"]
    daemon.expected = -signal.SIGKILL
    daemon.process.kill()
    daemon.wait()
    capture = only_capture(directory)
    times = [ping["t_ns"] * 1e-9 for ping in bench.truth()]
    period = (times[-1] - times[0]) / len(times)

    info = bench.sonarctl("capture", "info", capture)
    check(info.returncode == 1, "capture info does not tell the damage: %s" % info.stdout)
    lost_s = (live - pings_of(bench, capture)) * period
    note("kill -9: the last %.2f s of recording are lost" % lost_s)
    check(lost_s <= 2 * PATIENCE, "%.2f s of recording are lost" % lost_s)
    blocked = answers(bench, capture, "cut").splitlines()[-1].count(b'"blocked"')
    check(blocked >= 60, "only %d sectors blocked in the replay of what was left" % blocked)


def paced(bench):
    """--speed 1 takes as long as the recording; clients may ask meanwhile, and may not set the pose."""
    directory = bench.path("captures")
    _, daemon, client, _ = start(bench, directory, voyage=False)
    pings_until(client, 150)
    daemon.stop()
    capture = only_capture(directory)
    times = [float(line.split(",")[0]) for line in
             bench.sonarctl("capture", "export", "--csv", capture).stdout.splitlines() if line[:1].isdigit()]
    length = times[-1] - times[0]

    begin = time.monotonic()
    player = bench.sonard("--replay", capture, "--speed", "1", "--answers", bench.path("paced"), conf=False)
    client = player.client()
    pings = client.sensor()["pings"]
    until(lambda: pings < client.sensor()["pings"] < 150, "pings of the replay, one after the other")
    check(client.call("status")["mode"] == "replay", "status does not say replay")
    until(lambda: client.call("blocked", azimuth_deg=180, distance_m=7)["state"] == "blocked", "the wall behind")
    expect_refusal(client, "pose", {"attitude_deg": [0, 0, 0]}, "this is a replay", -32600)
    check(player.wait() == 0, "the replay fails")
    took = time.monotonic() - begin
    note("--speed 1: a capture of %.2f s took %.2f s" % (length, took))
    check(0.95 * length <= took <= length + 5 * PATIENCE, "%.2f s for a capture of %.2f s" % (took, length))
    begin = time.monotonic()
    with open(bench.path("paced"), "rb") as f:
        check(f.read() == answers(bench, capture, "fast"), "a paced replay gives other answers")
    note("as fast as it goes: %.2f s" % (time.monotonic() - begin))


def told(bench):
    """status tells of a recording while it grows, and the file has what it told."""
    directory = bench.path("captures")
    _, daemon, client, _ = start(bench, directory, voyage=False)
    record = lambda: client.call("status")["record"]
    before = record()["messages"]
    until(lambda: record()["messages"] > before + 20, "more messages")
    pings, last = client.sensor()["pings"], record()
    check(last["recording"] and last["error"] == "" and last["parts"] == 1, "record: %s" % last)
    daemon.stop()
    check(last["path"] == only_capture(directory), "status names %s" % last["path"])
    kept = pings_of(bench, last["path"])
    check(kept >= max(1, pings - last["lost_messages"]), "%d of %d pings are in the file: %s" % (kept, pings, last))


def on_request(bench):
    """Begins and ends when asked to: each time a file that is whole, with the configuration, and nothing in between."""
    directory = bench.path("captures")
    bench.sim(truth=True)
    bench.conf(sonar={"step": "1.8 deg"}, record={"directory": directory, "start": "on_request"})
    daemon = bench.sonard()
    client = daemon.client()
    record = lambda: client.call("status")["record"]
    pings_until(client, 20)
    waits = record()
    check(waits["paused"] and not waits["recording"] and waits["messages"] == 0 == waits["lost_messages"], "before: %s" % waits)
    check(waits["recording_age_s"] is None, "it has never recorded: %s" % waits)
    check(not glob.glob(os.path.join(directory, "*.mcap")), "a file before anybody asked for one")
    all_before = 0
    for turn in (1, 2):
        check("to " + directory in bench.sonarctl("record", "start").stdout, "sonarctl does not say where to")
        until(lambda: record()["recording"], "a file is there")
        again = bench.sonarctl("record", "start")
        check(again.returncode == 0 and again.stdout.startswith("already recording to %s, since 20" % record()["path"]), again.stdout + again.stderr)
        check(0 <= client.call("record_start")["recording_age_s"] < 600, record())
        before = record()["messages"]
        until(lambda: record()["messages"] > before + 20, "more messages")
        check("waits for" in bench.sonarctl("record", "stop").stdout, "sonarctl does not say that recording has ended")
        until(lambda: record()["waiting_bytes"] == 0, "all is on disk")
        last = record()
        files = sorted(glob.glob(os.path.join(directory, "*.mcap")))
        check(len(files) == turn == last["parts"] and last["lost_messages"] == 0 and last["error"] == "", "%s %s" % (files, last))
        count = last["messages"]
        check(last["recording_messages"] == count - all_before, "of this recording alone: %s" % last)
        all_before = count
        pings_until(client, client.sensor()["pings"] + 10)
        check(record()["messages"] == count, "messages are counted that nobody keeps")
    daemon.stop()
    for path in files:
        info = bench.sonarctl("capture", "info", path)
        check(info.returncode == 0 and "sonard.conf" in info.stdout and pings_of(bench, path) > 0, "%s: %s" % (path, info.stdout))


run([("on_request", on_request), ("same_answers", same_answers), ("killed", killed), ("paced", paced), ("told", told)], parallel=3, gate=("told", "on_request"))
