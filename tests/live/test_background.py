#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The background template: a bar of the vehicle's own frame, piles behind and beside it, walls that stand still."""
import glob
import os
import threading

from lib import check, expect_refusal, note, pings_until, run, until

TURN = 200  # pings of a full circle at 1.8 degrees

# A bar of 20 degrees astern, 0.8 m away; a pile behind its middle, 5.1 m, and one ahead to the right, 5.9 m.
FRAME = ("--frame", "200,20,0.8")
PILES = "cylinder 6 2 0.4\ncylinder -5 -1.82 0.2\n"
SHORT = {"clear_for": "15 s", "forget": "15 s"}  # some turns: what was learnt away is soon forgotten, too


def ask(client, azimuth_deg, distance_m):
    return client.call("blocked", azimuth_deg=azimuth_deg, distance_m=distance_m, half_angle_deg=1)


def state(client, azimuth_deg, distance_m):
    return ask(client, azimuth_deg, distance_m)["state"]


def expect(client, azimuth_deg, distance_m, wanted):
    answer = ask(client, azimuth_deg, distance_m)
    check(answer["state"] == wanted,
          "%g m at %g degrees: %s, expected %s" % (distance_m, azimuth_deg, answer, wanted))


def learnt(client, limit_s=60):
    return until(lambda: client.call("background")["state"] == "in force" and client.call("background"),
                 "the template to be learnt", limit_s, 0.2)


def check_masked(client):
    """The frame is gone, what lies behind it is unknown but for the pile, and all else is as it was."""
    until(lambda: all(state(client, az, 1.5) != "blocked" for az in range(191, 210)),
          "the frame to be no obstacle any more", 60)
    for azimuth_deg in (193, 207):
        expect(client, azimuth_deg, 1.5, "unknown")
    expect(client, 208, 9, "unknown")
    expect(client, 200, 7, "blocked")
    check(abs(ask(client, 200, 7)["range_m"] - 5.1) < 0.2, "the pile behind: %s" % ask(client, 200, 7))
    expect(client, 18.4, 7, "blocked")
    for azimuth_deg, distance_m in ((18.4, 5), (120, 9)):
        until(lambda: state(client, azimuth_deg, distance_m) == "clear", "%g degrees to be clear" % azimuth_deg)


def frame(bench, threads):
    """Learnt, masked, saved, there again after a restart, and cleared."""
    path = bench.path("head.bg")
    bench.sim(*FRAME, scene=bench.write("piles", PILES))
    bench.conf(sonar={"background": path}, grid=SHORT, pipeline={"threads": threads})
    daemon = bench.sonard()
    client = daemon.client()
    until(lambda: "runs without a template" in daemon.log(), "a missing file to be said")
    pings_until(client, TURN + 20)
    expect(client, 200, 1.5, "blocked")
    check(abs(ask(client, 200, 1.5)["range_m"] - 0.8) < 0.1, "the frame: %s" % ask(client, 200, 1.5))
    client.call("background_learn", pings=3, motion="any")
    result = learnt(client)
    check(result["template"]["clusters_kept"] == 1, "what was learnt: %s" % result)
    check(result["template"]["rows_learnt"] == 400 and not result["template"]["saved"], str(result))
    check_masked(client)
    check(client.sensor()["background"] == "in force", "status: %s" % client.sensor())
    check(client.call("background_save")["template"]["saved"], "not saved")

    drawing = bench.sonarctl("background", "show")
    check(drawing.returncode == 0 and drawing.stdout.count("#") >= 5, drawing.stdout + drawing.stderr)
    svg = bench.sonarctl("background", "show", "--svg", "-")
    check(svg.returncode == 0 and svg.stdout.rstrip().endswith("</svg>"), svg.stdout[-200:] + svg.stderr)

    daemon.stop()
    client = bench.sonard().client()
    check(client.call("background")["template"]["saved"], "not loaded at the start")
    pings_until(client, TURN + 20)
    check_masked(client)
    client.call("background_forget")
    pings_until(client, TURN + 20)
    expect(client, 200, 1.5, "blocked")
    check(os.path.exists(path), "clear has removed the file")
    client.call("background_load")
    check(client.call("background")["template"], "not loaded again")


def another_range(bench):
    """A template of 10 m serves a sonar that is then set to 6 m."""
    path = bench.path("head.bg")
    bench.sim(*FRAME, scene=bench.write("piles", PILES))
    bench.conf(sonar={"background": path}, grid=SHORT)
    daemon = bench.sonard()
    client = daemon.client()
    pings_until(client, TURN)
    client.call("background_learn", pings=3, motion="any")
    learnt(client)
    client.call("background_save")
    daemon.stop()
    bench.conf(sonar={"background": path, "range": "6 m"}, grid=SHORT)
    client = bench.sonard().client()
    pings_until(client, TURN + 20)
    fits = client.call("background")["template"]["fits"]
    check(fits.startswith("resampled"), fits)
    for azimuth_deg in (194, 206):
        expect(client, azimuth_deg, 1.5, "unknown")
    expect(client, 200, 5.8, "blocked")


def wall_by_rule(bench):
    """Nobody says whether the vehicle moves: walls are in every ping, and yet no part of the vehicle."""
    bench.sim(*FRAME, scene="box")
    bench.conf()
    client = bench.sonard().client()
    pings_until(client, TURN)
    answer = client.call("background_learn", pings=3)
    check(answer["state"] == "learning", str(answer))
    pings_until(client, 10)
    motion = client.call("background")["learning"]["motion"]
    check("without a pose" in motion, motion)
    template = learnt(client)["template"]
    note("%(clusters)s clusters, %(clusters_kept)s kept, %(blind_cells)s blind cells" % template)
    check(template["clusters"] >= 2 and template["clusters_kept"] == 1, str(template))
    pings_until(client, TURN + 20)
    for azimuth_deg, wall_m in ((0, 9), (90, 4), (180, 6), (270, 5)):
        expect(client, azimuth_deg, wall_m + 0.5, "blocked")


class Still(threading.Thread):
    """A vehicle that says ten times a second where it is."""

    def __init__(self, daemon):
        super().__init__(daemon=True)
        self.client = daemon.client()
        self.north_m = 0.0
        self.ended = threading.Event()

    def run(self):
        while not self.ended.wait(0.1):
            self.client.call("pose", attitude_deg=[0, 0, 0], position_m=[self.north_m, 0, 0])


def wall_by_motion(bench):
    """A vehicle that stands still learns nothing, until it moves or is told not to mind."""
    sim = bench.sim(*FRAME, scene="box")
    bench.conf()
    daemon = bench.sonard()
    client = daemon.client()
    vehicle = Still(daemon)
    vehicle.start()
    try:
        pings_until(client, TURN)
        client.call("background_learn", pings=2)
        pings_until(client, 3 * TURN)
        learning = client.call("background")["learning"]
        check(learning["least"] == 1 and learning["rows_full"] == 0 and learning["unmoved"] > TURN, str(learning))
        vehicle.north_m = 0.5
        sim.command("pose 0.5 0 0 0")
        learnt(client)
        client.call("background_learn", pings=60)
        pings_until(client, 10)
        expect_refusal(client, "background_stop", {"use": "yes"}, "too early")
        check(client.call("background_stop")["state"] == "in force", "the old template is gone")
    finally:
        vehicle.ended.set()
        vehicle.join()


def refusals(bench):
    """What cannot be done says why, and changes nothing."""
    path = bench.write("head.bg", b"SONARDBG\x01\0\0\0 and then nothing of use")
    bench.conf(sonar={"background": path})
    daemon = bench.sonard()
    client = daemon.client()
    until(lambda: "damaged" in daemon.log(), "the damaged file to be told")
    check(os.path.exists(path + ".damaged") and not os.path.exists(path), "the damaged file is not set aside")
    for method, params, why in (("background_learn", {}, "nothing to learn from"),
                                ("background_learn", {"pings": 65}, "pings"),
                                ("background_learn", {"sensor": "rear"}, "sensor"),
                                ("background_save", {}, "no template"),
                                ("background_save", {"file": "/etc/passwd"}, "file"),
                                ("background_load", {}, "No such file"),
                                ("background_forget", {}, "no template"),
                                ("background_stop", {}, "no learning in progress")):
        expect_refusal(client, method, params, why)
    check(client.call("background")["state"] == "none", "something is in force")
    bench.write("head.bg", "not a template at all")
    refused = bench.sonarctl("background", "load")
    check(refused.returncode == 6 and "not a background template" in refused.stderr, refused.stderr)
    check(os.path.exists(path), "a file that is none of ours was moved")


def replay(bench):
    """At the desk: a template from a capture."""
    folder = bench.path("captures")
    os.mkdir(folder)
    bench.sim(*FRAME, scene=bench.write("piles", PILES))
    bench.conf(sonar={"background": bench.path("head.bg")})
    daemon = bench.sonard("--record", folder)
    pings_until(daemon.client(), 6 * TURN, 60)
    daemon.stop()
    (capture,) = glob.glob(os.path.join(folder, "*.mcap"))
    daemon = bench.sonard("--replay", capture, "--speed", "4", "--stay", conf=False)
    client = daemon.client()
    until(lambda: client.sensor()["pings"] > 10, "the replay to begin")
    learning = bench.sonarctl("background", "learn", "--pings", "3", "--standing")
    check(learning.returncode == 0 and "in force" in learning.stdout, learning.stdout + learning.stderr)
    saved = bench.sonarctl("background", "save")
    check(saved.returncode == 0 and os.path.exists(bench.path("head.bg")), saved.stderr)
    daemon.stop()
    again = bench.sonard("--replay", capture, "--speed", "4", "--stay", conf=False).client()
    check("the present template" in again.call("background")["happened"], str(again.call("background")))


def ended(bench):
    """When a replay has ended no ping comes any more: learning is refused, instead of waited for without end."""
    daemon = bench.sonard("--replay", "tests/replay/box.mcap", "--stay", "--socket", bench.socket_path, conf=False)
    client = daemon.client()
    until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay")
    out = bench.sonarctl("background", "learn")
    check(out.returncode == 6 and "the replay has ended" in out.stderr, "learn: %s" % out)
    out = bench.sonarctl("background", "show")
    check("happened   nothing yet" in out.stdout, "show: %s" % out)
    pings = client.call("explain", azimuth_deg=0, distance_m=2)["pings"]
    check(pings["back_to_s"] and pings["back_to_s"] >= 4, "pings reach back to the first, at 0: %s" % pings)


cases = [("frame_threads%d" % n, lambda bench, n=n: frame(bench, n)) for n in (0, 1, 2)]
cases += [("another_range", another_range), ("wall_by_rule", wall_by_rule), ("wall_by_motion", wall_by_motion),
          ("refusals", refusals), ("replay", replay), ("ended", ended)]

run(cases, parallel=4, gate=("refusals", "ended"))
