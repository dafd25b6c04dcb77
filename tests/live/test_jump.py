#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The method replay: a capture is paused, and jumped in to any time of it. What is answered there is what a replay that
played straight to that time answers, bit for bit."""
import json
import os
import random
import time

from lib import SEED, Failed, check, expect_refusal, jump, note, refused, run, until

CAPTURE = "tests/replay/box.mcap"


def playing(bench, *arguments, **pipes):
    """A replay that has not ended, paused."""
    daemon = bench.sonard("--replay", CAPTURE, "--stay", "--speed", "0.001", "--socket", bench.socket_path, *arguments, conf=False, **pipes)
    daemon.client().call("replay", pause="yes")
    return daemon


def everything(client):
    """Answers that depend on all that was played."""
    pages, cursor = [], None
    while cursor is not None or not pages:
        page = client.call("grid_cells", **({"cursor": cursor} if cursor else {}))
        pages.append(page)
        cursor = page["cursor"]
    status = client.call("status")
    del status["server"]
    return json.dumps([client.call(m) for m in ("sectors", "image", "clusters", "next_look", "nearest", "background", "map")] +
                      [status, pages], sort_keys=True)


def straight_lines(bench, every_s=0.5):
    path = bench.path("straight.jsonl")
    bench.sonard("--replay", CAPTURE, "--socket", "none", "--answers", path, "--every", str(every_s), conf=False).wait()
    with open(path, encoding="ascii") as f:
        return f.read()


def same(bench):
    """After any jumps, back and forth, everything is as after one straight to there."""
    rng = random.Random(SEED)
    note("seed %d" % SEED)
    lines = [json.loads(line) for line in straight_lines(bench).splitlines()]
    for threads in ("0", "2"):
        direct, about = playing(bench, "--threads", threads), None
        length_s = direct.client().call("status")["replay"]["length_s"]
        check(length_s > 4, length_s)
        to_s = rng.choice([0.5 * k for k in range(3, int(length_s / 0.5))])
        wanted = everything(jump(direct, to_s))
        sectors = jump(direct, to_s).call("sectors")
        line = next(one["sectors"] for one in lines if one["event"] == "time" and abs(one["sectors"]["t_unix"] - sectors["t_unix"]) < 1e-6)
        check(sectors["sectors"] == line["sectors"], "%s threads: a replay that never stopped says something else" % threads)
        direct.stop()
        about = playing(bench, "--threads", threads)
        way = [rng.uniform(0, length_s + 0.5) for _ in range(4)] + [length_s + 1, rng.uniform(0, to_s), to_s]
        for at_s in way:
            client = jump(about, at_s)
        check(everything(client) == wanted, "%s threads: by way of %s, %g s is something else" % (threads, way, to_s))
        check(jump(about, to_s / 2).call("replay")["position_s"] < to_s, "it does not go back")
        check(everything(jump(about, to_s)) == wanted, "another time, it is something else")
        about.stop()


def all_answers(bench):
    """Paused, played and jumped on in: all lines of --answers are those of a replay that never stopped."""
    rng = random.Random(SEED)
    note("seed %d" % SEED)
    path = bench.path("paused.jsonl")
    daemon = playing(bench, "--answers", path, "--every", "0.5")
    jump(daemon, 3)
    at_s = 0.0
    for _ in range(6):
        client = jump(daemon, at_s)
        client.call("replay", pause="no", speed=rng.choice((1, 3)))
        time.sleep(0.1)
        at_s = client.call("replay", pause="yes")["position_s"] + rng.uniform(0, 0.7)
    client = jump(daemon, 1000)
    check(client.call("status")["mode"] == "replay, ended", client.call("status")["replay"])
    daemon.stop()
    with open(path, encoding="ascii") as f:
        got = f.read()
    check(got == straight_lines(bench), "other answers")


def pauses(bench):
    """While it is paused, the clock stands; then it goes on from there at the speed that is wanted."""
    daemon = playing(bench)
    client = jump(daemon, 2)
    before = client.call("status")
    time.sleep(0.3)
    after = client.call("status")
    check(before["t_unix"] == after["t_unix"] and after["replay"]["paused"] and before["mode"] == "replay", after["replay"])
    state = client.call("replay", pause="no", speed=0.25)
    check(state["speed"] == 0.25 and not state["paused"], state)
    until(lambda: client.call("status")["replay"]["position_s"] > 2.2, "it to go on")
    check(client.call("status")["mode"] == "replay", "it went on as fast as it goes")
    client.call("replay", speed=0)
    until(lambda: client.call("status")["mode"] == "replay, ended", "the end")
    client = jump(daemon, 1, pause="yes")
    check(client.call("status")["replay"]["position_s"] == 1, "not back from the end")
    for wrong in ({"to_s": -1}, {"speed": -1}, {"pause": "maybe"}):
        refused(client, "replay", -32602, **wrong)
    check(client.call("status")["replay"]["position_s"] == 1, "a refused request changed something")
    said = bench.sonarctl("replay", "--to", "1.5")
    check(said.returncode == 0 and '"jumping": true' in said.stdout, said)
    jump(daemon, 0.5)
    check(daemon.stop() == 0, "SIGTERM after a jump")


def asked_at_once(bench):
    """Of several requests that come together the last one holds, and a jump back among them is no end."""
    for first, then in ((0, 4), (0, 0.5), (3, 1)):
        daemon = playing(bench)
        client = jump(daemon, 2)
        client.send(b"".join(b'{"jsonrpc":"2.0","id":%d,"method":"replay","params":{"to_s":%g}}\n' % (k, to_s) for k, to_s in enumerate((first, then))))
        answers = [client.reply(), client.reply()]
        check(all(one is None or one["result"]["jumping"] for one in answers), answers)

        def there():
            try:
                state = daemon.client().call("status")["replay"]
            except (Failed, OSError):
                return False
            check(daemon.status is None, "it ended: " + daemon.log())
            return not state["jumping"] and abs(state["position_s"] - then) < 1e-3
        until(there, "%g s, after %g s" % (then, first))
        check(daemon.stop() == 0, "SIGTERM")


def on_standard_output(bench):
    """--answers - goes on after a jump back: all of a replay that never stopped comes after what was cut short."""
    with open(bench.path("printed.jsonl"), "wb") as printed:
        daemon = playing(bench, "--answers", "-", "--every", "0.5", stdout=printed)
    jump(daemon, 3)
    for _ in range(2):
        jump(daemon, 1)
    client = jump(daemon, 1000)
    check(client.call("status")["mode"] == "replay, ended", client.call("status")["replay"])
    check(daemon.stop() == 0, "SIGTERM: " + daemon.log())
    with open(bench.path("printed.jsonl"), encoding="ascii") as f:
        lines = f.read().splitlines()
    wanted = straight_lines(bench).splitlines()
    check(len(lines) > len(wanted) and lines[-len(wanted):] == wanted, "other lines at the end")
    check([json.loads(line)["event"] for line in lines].count("end") == 1, "it says that it ended where it was cut short")


def live(bench):
    """What is no replay has none."""
    bench.sim()
    bench.conf()
    client = bench.sonard().client()
    check(client.call("status")["replay"] is None, "a replay")
    expect_refusal(client, "replay", {"pause": "yes"}, "--replay")


run([("jump_" + f.__name__, f) for f in (same, all_answers, pauses, asked_at_once, on_standard_output, live)],
    gate=("jump_same", "jump_all_answers", "jump_asked_at_once", "jump_on_standard_output", "jump_live"))
