#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Replays of one capture: the same answers with any number of threads, by jumps, and of what a power cut leaves."""
import json
import os

from voyage import ping360

from lib import SONARD, check, expect_refusal, note, run

TURN = 200  # pings of a full circle at 1.8 degrees


def sail(bench, step="1.8 deg", pings=2 * TURN):
    """The vehicle turns slowly and drifts ahead, then comes to rest."""
    bench.conf(sonar={"step": step}, answers={"look_ahead": "200 m"})
    trip = ping360(bench)
    steps = 0
    while trip.made < pings:
        steps += 1
        trip.place(0.01 * steps, 0, 0, 0.5 * steps)
        trip.run(0.1)
    trip.sonar("silent 60")
    for _ in range(3):
        trip.place(0.01 * steps, 0, 0, 0.5 * steps)
        trip.run(0.1)
    return trip, steps + 3


def replay(bench, capture, *arguments, status=0):
    result = bench.run(SONARD, "--replay", capture, "--socket", "none", *arguments)
    check(result.returncode == status, "replay ends with %d: %s" % (result.returncode, result.stderr[-500:]))


def answers(bench, capture, name, *arguments):
    replay(bench, capture, "--answers", bench.path(name), *arguments)
    with open(bench.path(name), "rb") as f:
        return f.read()


def pings_of(bench, capture):
    """Ping lines of the exported capture."""
    result = bench.sonarctl("capture", "export", "--csv", capture)
    return sum(1 for line in result.stdout.splitlines() if line[:1].isdigit())


def same_answers(bench):
    """With any number of threads the same bytes; and at the end the same sectors as a client is told."""
    trip, poses = sail(bench)
    capture = trip.end()
    info = bench.sonarctl("capture", "info", capture)
    check(info.returncode == 0, "capture info: %s" % info.stderr)
    for word in ("/head/rx", "/head/tx", "/pose", "sonard.conf"):
        check(word in info.stdout, "capture info does not tell %s" % word)
    check(pings_of(bench, capture) == trip.made, "%d pings in the capture, %d made" % (pings_of(bench, capture), trip.made))
    first = answers(bench, capture, "first", "--threads", "0")
    lines = [json.loads(line) for line in first.splitlines()]
    events = [line["event"] for line in lines]
    check(len(events) >= 2 and events[-1] == "end", "events: %s" % events)
    for name, threads in (("again", "0"), ("one", "1"), ("two", "2"), ("two_again", "2")):
        check(answers(bench, capture, name, "--threads", threads) == first,
              "the answers of run '%s' with %s threads differ" % (name, threads))
    client = trip.client()
    told = client.call("sectors")["sectors"]
    check(told == lines[-1]["sectors"]["sectors"], "a client is told other sectors than the file")
    blocked = sum(s["state"] == "blocked" for s in told)
    check(blocked >= 68, "only %d sectors blocked" % blocked)
    status = client.call("status")
    check(status["pose"]["count"] == poses and client.sensor()["pings"] == trip.made, "not all was replayed: %s" % status)
    expect_refusal(client, "pose", {"attitude_deg": [0, 0, 0]}, "this is a replay", -32600)


def same_capture(bench):
    """A voyage depends on nothing but the test: made twice, byte for byte the same."""
    contents = []
    for _ in range(2):
        with open(sail(bench, pings=50)[0].end(), "rb") as f:
            contents.append(f.read())
    check(contents[0] == contents[1], "two voyages differ, of %d and %d bytes" % tuple(map(len, contents)))


def jumps(bench):
    """Sent from moment to moment, back too, a replay is where a plain one is."""
    trip, _ = sail(bench)
    told = {}
    at = trip.moments()
    for s in (1, 2.5, 4, 2.5, 1, trip.now_s, 4):
        client = at(s)
        here = client.call("sectors"), client.sensor()["pings"], client.call("status")["pose"]["count"]
        check(told.setdefault(s, here) == here, "at %g s it depends on the way there: %s, %s" % (s, told[s], here))
    pings = [told[s][1] for s in sorted(told)]
    check(pings == sorted(set(pings)) and pings[-1] == trip.made, "pings: %s" % pings)
    bench.processes[-1].stop()
    plain = trip.client()
    check(plain.call("sectors") == told[trip.now_s][0], "the end of a replay without jumps differs")


def cut(bench):
    """Cut off anywhere, as by a power cut: what is there can be read, repaired and replayed, and is all up to the last chunk."""
    trip, _ = sail(bench, step="3.6 deg", pings=500)
    capture = trip.end()
    whole, kept = os.path.getsize(capture), []
    with open(capture, "rb") as f:
        content = f.read()
    for tenth in range(3, 10):
        part, repaired = bench.write("part.mcap", content[:whole * tenth // 10]), bench.path("repaired%d.mcap" % tenth)
        info = bench.sonarctl("capture", "info", part)
        check(info.returncode == 1, "capture info does not tell the damage: %s" % info.stdout)
        result = bench.sonarctl("capture", "repair", part, repaired)
        check(result.returncode == 0, "repair: %s" % result.stderr)
        info = bench.sonarctl("capture", "info", repaired)
        check(info.returncode == 0, "the repaired capture is damaged: %s %s" % (info.stdout, info.stderr))
        kept.append(pings_of(bench, part))
        check(pings_of(bench, repaired) == kept[-1], "the repair lost pings")
        check(answers(bench, part, "part") == answers(bench, repaired, "whole"), "the repaired capture gives other answers")
    note("pings of %d that are left by 3 to 9 tenths of the file: %s" % (trip.made, kept))
    check(kept == sorted(kept), "more of the file has fewer pings: %s" % kept)
    check(all(abs(k / trip.made - t / 10) < 0.1 for t, k in zip(range(3, 10), kept)), "pings of %d: %s" % (trip.made, kept))


run([("record_" + f.__name__, f) for f in (same_answers, same_capture, jumps, cut)])
