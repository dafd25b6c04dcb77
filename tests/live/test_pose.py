#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""One pose from the shell, as a user gives it on the first day: it is named when it is missed, kept up by `--rate`, taken
back by `--withdraw`, and a replay knows all of it."""
import glob
import subprocess
import time

from lib import SONARCTL, check, pings_until, run, until

TURN = 200  # pings of a full circle at 1.8 degrees


def ctl(bench, *words):
    done = bench.sonarctl(*words)
    return done.returncode, done.stdout, done.stderr


def start(bench, *arguments):
    bench.sim()
    bench.conf(vehicle={"station_keeping": "0 m/s"})
    daemon = bench.sonard(*arguments)
    return daemon, daemon.client()


def states(client):
    return {s["state"] for s in client.call("sectors", distance_m=0)["sectors"]}


def test_a_pose_that_was_given_once_can_be_taken_back(bench):
    _, client = start(bench)
    until(lambda: states(client) == {"blocked"}, "a turn without a pose", 60)
    status, out, _ = ctl(bench, "pose", "--attitude", "0,0,90")
    check(status == 0 and "--rate" in out and "--withdraw" in out, out)
    until(lambda: states(client) == {"unknown"}, "a pose that is too old")
    lost = client.call("blocked", azimuth_deg=0, distance_m=1)
    check("the attitude from a client is" in lost["reason"] and "(limit 1 s)" in lost["reason"], lost["reason"])
    _, shown, _ = ctl(bench, "status")
    check("the attitude from a client is" in shown and "--withdraw" in shown, shown)
    check("heard before" not in shown, shown)
    until(lambda: client.call("status")["grid"]["no_attitude"] > 0, "a ping while the pose is missing")
    status, out, _ = ctl(bench, "pose", "--withdraw")
    check(status == 0 and "pose withdrawn" in out, out)
    pose = client.call("status")["pose"]
    check(pose["withdrawn"] == 1 and pose["has"] == [] and pose["missing"] == "", str(pose))
    check(client.call("pose_withdraw") == {"withdrawn": False}, "withdrawn twice")
    pings_until(client, TURN + 10, 60)
    check(states(client) == {"blocked"}, "a turn later: %s" % states(client))


def test_rate_keeps_the_pose_fresh(bench):
    _, client = start(bench)
    sender = subprocess.Popen([SONARCTL, "--socket", bench.socket_path, "pose", "--attitude", "0,0,90", "--rate", "10"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        until(lambda: client.call("status")["pose"]["attitude_deg"] == [0, 0, 90], "the attitude")
        until(lambda: states(client) == {"blocked"}, "a turn with the pose", 60)
        begin, count = time.monotonic(), client.call("status")["pose"]["count"]
        while time.monotonic() < begin + 2.5:
            check(states(client) == {"blocked"}, "unknown in between")
            time.sleep(0.2)
        more = client.call("status")["pose"]["count"] - count
        check(10 <= more <= 30, "%d poses in 2.5 s" % more)
    finally:
        sender.terminate()
        out, error = sender.communicate(timeout=10)
    check(out.count("pose accepted") == 1 and "10 times a second" in error, out + error)
    until(lambda: states(client) == {"unknown"}, "the end of the poses")
    pose = client.call("status")["pose"]
    check(pose["attitude_deg"] is None and pose["age_s"] > 1, "an old attitude is told as if it were one: %s" % pose)


def test_settings_that_do_not_fit_are_named(bench):
    """A pose that is stale before the next comes, and a turn longer than anything stays known."""
    bench.sim()
    bench.conf(vehicle={"station_keeping": "0 m/s"}, pose={"max_age": "200 ms"}, grid={"forget": "1 s"})
    client = bench.sonard().client()
    wanted = "poses come less often than max_age: between them every answer is unknown"
    seen = set()

    def give():
        client.call("pose", attitude_deg=[0, 0, 9])
        seen.add(client.call("status")["data"])
        time.sleep(0.25)
        return wanted in seen
    until(give, "the sparse poses to be named", 60)
    client.call("pose_withdraw")
    until(lambda: client.call("status")["data"].startswith("a revolution of the head takes longer than forget"),
          "the turn to be too long", 60)


def test_a_replay_knows_that_it_was_withdrawn(bench):
    daemon, client = start(bench, "--record", bench.path("kept"))
    pings_until(client, 5)
    client.call("pose", attitude_deg=[0, 0, 90])
    until(lambda: client.call("status")["grid"]["no_attitude"] > 0, "pings without a pose")
    client.call("pose_withdraw")
    until(lambda: states(client) == {"blocked"}, "a turn", 60)
    daemon.stop()
    capture, = glob.glob(bench.path("kept/*.mcap"))
    replay = bench.sonard("--replay", capture, "--stay", "--socket", bench.socket_path, conf=False)
    again = replay.client()
    until(lambda: again.call("status")["mode"] == "replay, ended", "the replay's end", 60)
    pose = again.call("status")["pose"]
    check(pose["withdrawn"] == 1 and pose["count"] == 1, str(pose))
    check(again.call("sectors", distance_m=0)["sectors"][0]["state"] == "blocked", "not as live")


def test_what_does_not_go_together_is_refused(bench):
    for words, wanted in ((["--rate", "5"], "at least one part"), (["--withdraw", "--depth", "3"], "stands alone"),
                          (["--depth", "3", "--time", "5", "--rate", "5"], "exclude each other"),
                          (["--depth", "3", "--rate", "500"], "from 0.1 to 50")):
        status, _, error = ctl(bench, "pose", *words)
        check(status == 3 and wanted in error, "%s: %d %s" % (words, status, error))


if __name__ == "__main__":
    run([(name[5:], case) for name, case in list(globals().items()) if name.startswith("test_")], 2)
