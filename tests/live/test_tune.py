#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""sonard-tune on a recording: what it writes holds the bound, repeats to the byte, and is never more certain than the
reference; a bound that cannot be held leaves no file."""
import json
import os

from lib import BUILD, SONARD, check, run

TOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
TUNE = os.path.join(TOP, "python", "sonard-tune")
CAPTURE = os.path.join(TOP, "tests", "replay", "box.mcap")
FINE = {"sensor_model": "gauss", "angular_step": "1 deg", "range": "3 m"}


def tune(bench, *arguments, out="tuned.conf"):
    return bench.run(TUNE, "--sonard", SONARD, "--every", "0.25", "-o", bench.path(out), *arguments, CAPTURE)


def conf(bench, **grid):
    """The recording's configuration, with another grid."""
    with open(os.path.join(TOP, "tests", "replay", "box.conf"), encoding="ascii") as f:
        text = f.read()
    return bench.write("box.conf", text + "[grid]\n" + "".join("%s = %s\n" % item for item in grid.items()))


def answers(bench, path, name):
    out = bench.path(name)
    done = bench.run(SONARD, "--replay", CAPTURE, "-c", path, "--socket", "none", "--answers", out, "--every", "0.25")
    check(done.returncode == 0, done.stderr)
    with open(out, encoding="ascii") as f:
        return [json.loads(line) for line in f]


def read(bench, name):
    with open(bench.path(name), encoding="ascii") as f:
        return f.read()


def holds(bench):
    """What it writes is a good configuration, costs less, and its answers hold the bound against those of the fine one."""
    path = conf(bench, **FINE)
    done = tune(bench, "-c", path)
    check(done.returncode == 0, done.stderr)
    check("falsely clear" in done.stdout and "changed: [grid]" in done.stdout, done.stdout)
    fine = answers(bench, path, "fine")
    plan = json.loads(bench.run(SONARD, "-c", path, "--explain=json").stdout)
    os.mkdir(path + ".d")
    os.rename(bench.path("tuned.conf"), os.path.join(path + ".d", "60-tuned.conf"))
    check(bench.run(SONARD, "--check", path).returncode == 0, "the scene is no good configuration")
    tuned_plan = json.loads(bench.run(SONARD, "-c", path, "--explain=json").stdout)
    check(tuned_plan["instructions"] < plan["instructions"], "saves nothing")
    near = ranges = known = lost = 0
    tuned = answers(bench, path, "coarse")
    check(len(fine) == len(tuned) >= 15, "answers: %d and %d" % (len(fine), len(tuned)))
    for a, b in zip(fine, tuned):
        for want, got in zip(a["sectors"]["sectors"], b["sectors"]["sectors"]):
            check(want["state"] == "clear" or got["state"] != "clear", "falsely clear: %s, %s" % (want, got))
            known += want["state"] != "unknown"
            lost += want["state"] != "unknown" and got["state"] != want["state"]
            if want["state"] == got["state"] == "blocked":
                ranges += 1
                near += abs(want["range_m"] - got["range_m"]) <= 0.1
    check(ranges > 100 and near >= 0.95 * ranges and lost <= 0.05 * known, "%d of %d, %d lost" % (near, ranges, lost))


def repeats(bench):
    """The same file, to the byte, with any number of jobs."""
    for jobs in ("1", "3"):
        done = tune(bench, "--jobs", jobs, out="jobs" + jobs)
        check(done.returncode == 0, done.stderr)
    check(read(bench, "jobs1") == read(bench, "jobs3"), "two results")


def refuses(bench):
    """A bound that nothing holds, a capture that tells nothing, a file that is there: nothing is written over."""
    path = conf(bench)
    lines = answers(bench, path, "answers")
    for line in lines:
        for sector in line["sectors"]["sectors"]:
            if sector["state"] == "blocked":
                sector["range_m"] += 0.5
    truth = bench.write("truth", "".join(json.dumps(line) + "\n" for line in lines))
    for line in lines:
        for sector in line["sectors"]["sectors"]:
            free = sector["free_to_m"] > 0.5
            sector.update({"state": "blocked", "range_m": 0.3} if free else {"state": "unknown"})
    solid = bench.write("solid", "".join(json.dumps(line) + "\n" for line in lines))
    for arguments, why in ((("--reference", truth), "do not hold the bound"),
                           (("--reference", solid, "--share", "0", "--lost", "100", "--margin", "0", "--every", "0.05"), "do not hold the bound"),
                           (("--tune-on", "1"), "tells too little"),
                           (("--config", bench.write("bad.conf", "[sonar box]\n")), "bad.conf"),
                           (("--reference", CAPTURE), "no answer")):
        done = tune(bench, *arguments)
        check(done.returncode == 1 and why in done.stderr, "%s: %s" % (arguments, done.stderr))
        check(not os.path.exists(bench.path("tuned.conf")), "%s: wrote a file" % (arguments,))
    bench.write("tuned.conf", "mine")
    check(tune(bench).returncode == 1 and read(bench, "tuned.conf") == "mine", "wrote over a file")


def truth_holds(bench):
    """A truth of one line holds for the whole capture; what is falsely clear against it is never written."""
    lines = answers(bench, conf(bench), "answers")
    truth = lines[-1]
    truth["sectors"]["t_unix"] = 0
    known = [s for s in truth["sectors"]["sectors"] if s["state"] == "blocked"]
    done = tune(bench, "--reference", bench.write("truth", json.dumps(truth)), "--lost", "100", "--tune-on", "80")
    check(done.returncode == 0 and len(known) > 10, done.stderr)
    check("Reference: truth." in read(bench, "tuned.conf"), read(bench, "tuned.conf"))


check(os.path.isdir(BUILD), "no build")
run([("tune_" + f.__name__, f) for f in (holds, repeats, refuses, truth_holds)])
