#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""sonard-tune on a recording and on basins made up from a seed (SONARD_SEED=): what it writes holds the bound in every band of
elevations and every grid, with a truth and without, repeats to the byte, and is never more certain than the reference; a
bound that cannot be held leaves no file; a truth is judged by itself; the search ends where no small change is cheaper.
BASINS=n tries so many seeds, each with another basin, configuration and bound; one of each kind by itself."""
import importlib.util
import itertools
import json
import math
import os
import random
import shutil
import sys
import types
import typing
from importlib.machinery import SourceFileLoader

from lib import BUILD, SEED, SONARCTL, SONARD, check, note, run

TOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
TUNE = os.path.join(TOP, "python", "sonard-tune")
CAPTURE = os.path.join(TOP, "tests", "replay", "box.mcap")
BASINS = int(os.environ.get("BASINS") or 1)
FINE = {"sensor_model": "gauss", "angular_step": "1 deg", "range": "3 m"}


def tune(bench, *arguments, out="tuned.conf"):
    return bench.run(TUNE, "--sonard", SONARD, "--every", "0.25", "-o", bench.path(out), *arguments, CAPTURE, limit_s=240)


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
    check(tuned_plan["bytes"] < plan["bytes"], "saves nothing")
    near = ranges = known = lost = 0
    tuned = answers(bench, path, "coarse")
    check(len(fine) == len(tuned) >= 15, "answers: %d and %d" % (len(fine), len(tuned)))
    for a, b in zip(fine, tuned):
        for want, got in zip(a["sectors"]["sectors"], b["sectors"]["sectors"]):
            farther = want["state"] == "blocked" and got["free_to_m"] <= want["range_m"]  # than it was judged
            check(want["state"] == "clear" or got["state"] != "clear" or farther, "falsely clear: %s, %s" % (want, got))
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
            free = sector["free_to_m"] > 0.1
            sector.update({"state": "blocked", "range_m": 0.05} if free else {"state": "unknown"})
    solid = bench.write("solid", "".join(json.dumps(line) + "\n" for line in lines))
    for arguments, why in ((("--reference", truth), "do not hold the bound"),
                           (("--reference", solid, "--share", "0", "--lost", "100", "--margin", "0", "--every", "0.05"), "do not hold the bound"),
                           (("--tune-on", "1"), "tells too little"),
                           (("--config", bench.write("bad.conf", "[sonar box]\n")), "bad.conf"),
                           (("--reference", CAPTURE), "no answer")):
        done = tune(bench, *arguments)
        check(done.returncode == 1 and why in done.stderr, "%s: %s" % (arguments, done.stderr))
        check(not os.path.exists(bench.path("tuned.conf")), "%s: wrote a file" % (arguments,))
    for jobs in ("0", "-1", "two"):
        done = tune(bench, "--jobs", jobs)
        check(done.returncode == 2 and "argument --jobs" in done.stderr, "--jobs %s: %s" % (jobs, done.stderr))
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


def needs_no_folder(bench):
    """The folder of maps that the configuration names stays with the daemon that has it, and is not read: replays side by side
    do without."""
    path = conf(bench, **FINE)
    with open(path, "a", encoding="ascii") as f:
        f.write("[map]\nvoxel = 0.2 m\nmemory = 32 MiB\ndirectory = %s\nload = last\nsave_every = 60 s\n" % bench.path("maps"))
    done = tune(bench, "-c", path, "--directions", "--jobs", "2")
    check(done.returncode == 0 and "changed: [map] voxel = none" in done.stdout, done.stdout + done.stderr)
    check(not os.path.exists(bench.path("maps")), "a replay has made the folder")
    check("directory" not in read(bench, "tuned.conf"), read(bench, "tuned.conf"))


# ---- basins ----

RANGE_M, BINS, PINGS, TURN = 6.0, 200, 300, 200
EVERY_S = "2"


class Bound(typing.NamedTuple):
    """What sonard-tune is asked to hold: share and lost in percent, margin as a share of the slack that they leave."""

    within_m: float
    share: float
    lost: float
    margin: float

    @staticmethod
    def of(dice):
        """From one that little but the reference holds to one that nearly all do."""
        return Bound(dice.choice([0.05, 0.1, 0.3]), dice.choice([70.0, 85.0, 95.0]), dice.choice([2.0, 10.0, 30.0]),
                     dice.choice([0.0, 0.2, 0.4]))

    def tighter(self):
        """By its margin, as it is held where it is tuned."""
        return Bound(self.within_m * (1 - self.margin), self.share + (100 - self.share) * self.margin, self.lost * (1 - self.margin), 0)

    def arguments(self):
        return ["--within", str(self.within_m), "--share", str(self.share), "--lost", str(self.lost), "--margin",
                str(100 * self.margin)]

    def broken(self, pairs, told):
        """Why it does not hold of pairs of sectors; told: by a truth, so that unknown says nothing."""
        known = lost = ranges = near = 0
        for a, b in pairs:
            if b["state"] == "clear" and (a["state"] == "blocked" and b["free_to_m"] > a["range_m"] or
                                          a["state"] == "unknown" and not told):
                return "falsely clear: %s, %s" % (a, b)
            if a["state"] == "blocked" and b["free_to_m"] > a["range_m"] + self.within_m:
                return "free beyond an obstacle: %s, %s" % (a, b)
            known += a["state"] != "unknown"
            lost += a["state"] != "unknown" and b["state"] == "unknown" or a["state"] == "clear" and b["state"] == "blocked"
            if a["state"] == b["state"] == "blocked":
                ranges += 1
                near += abs(a["range_m"] - b["range_m"]) <= self.within_m
        if known < 100 or near < self.share / 100 * ranges or lost > self.lost / 100 * known:
            return "%d known, %d lost, %d of %d ranges near" % (known, lost, near, ranges)
        return None


def wall_m(basin, azimuth_deg):
    """To the nearest wall of (ahead, right, astern, left), or to a post of 4 degrees before one."""
    walls, posts_deg = basin
    x, y = math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))
    post = any(abs((azimuth_deg - p + 180) % 360 - 180) <= 2 for p in posts_deg)
    return min(d / c for d, c in zip(walls, (x, y, -x, -y)) if c > 1e-6) * (0.6 if post else 1)


def dump(dice, basin):
    """What a Ping360 sends in such a basin, as the text that sonarctl imports."""
    text = []
    for n in range(PINGS):
        grad = 2 * n % 400
        wall = wall_m(basin, 0.9 * grad - 180) / RANGE_M * BINS
        data = [255 if i < 12 else int(dice.uniform(0, 25) + max(0, 170 - 40 * abs(i - wall))) for i in range(BINS)]
        fields = {"mode": 0, "gain_setting": 0, "angle": grad, "transmit_duration": 40,
                  "sample_period": round(RANGE_M / BINS / 750 / 25e-9), "transmit_frequency": 750, "number_of_samples": BINS,
                  "data_length": BINS, "data": ["0x%02x" % v for v in data]}
        text.append("ID: 2300 - device_data\nPayload:\n" + "".join("  - %s: %s\n" % f for f in fields.items()) + "Checksum: -\n")
    return "".join(text)


def truth_of(basin, t_s):
    """One line that holds from then on; what lies at the end of what was listened to, or beyond, is not told."""
    sectors = []
    for k in range(72):
        near = min(wall_m(basin, 5 * k + off) for off in (-2.5, -1.25, 0, 1.25, 2.5))
        known = near < RANGE_M - 0.5
        sectors.append({"state": "blocked", "range_m": near} if known else {"state": "unknown"})
    return json.dumps({"sectors": {"t_unix": t_s, "sectors": sectors}}) + "\n"


def lines_of(path):
    with open(path, encoding="ascii") as f:
        return [json.loads(line) for line in f]


def played(bench, capture, path, name):
    out = bench.path(name)
    done = bench.run(SONARD, "--replay", capture, "-c", path, "--socket", "none", "--answers", out, "--every", EVERY_S, "--bands")
    check(done.returncode == 0, done.stderr)
    return [(tuple(line["asked"]["elevation_deg"]), line["asked"]["grid"], line["sectors"]) for line in lines_of(out)]


HORIZON = ((-5.0, 5.0), "main")


def told_pairs(truth, lines, begin_s, end_s=math.inf):
    """Sectors of the truth and of the answers at its place, from begin_s on and before end_s."""
    return [(a, b) for x in lines if x[:2] == HORIZON and begin_s <= x[2]["t_unix"] < end_s
            for a, b in zip(json.loads(truth)["sectors"]["sectors"], x[2]["sectors"])]


def must_refuse(bound, truth, fine, turn_s, tune_on):
    """Why no settings hold the bound: against the truth the careful ones themselves break it, tighter where it is tuned."""
    times = sorted({line[2]["t_unix"] for line in fine})
    begin = times[int(len(times) * tune_on / 100)]
    return bound.tighter().broken(told_pairs(truth, fine, turn_s, begin), True) or bound.broken(told_pairs(truth, fine, begin), True)


def settings(dice):
    """A careful configuration: sonard-tune has it as its own reference."""
    extract = dice.choice(["detector = os\n", "otsu = on\n", "median = 3\nclasses = on\n", ""])
    return ("[sonar box]\ndevice = ping360\nport = serial:/dev/x:115200\nrange = %g m\n[extract]\nno_echo = %s\n%s"
            "[grid]\nangular_step = 1 deg\nsensor_model = %s\n[grid other]\nforget = 60 s\n" %
            (RANGE_M, dice.choice(["minimum", "heard"]), extract, dice.choice(["gauss", "midpoint", "opening"])))


def basin(bench, seed, with_truth):
    """A basin, configuration, bound and way of judging by the seed; what is written is judged anew, as a user would have it.
    Where the careful settings miss the truth by too much, it must be refused."""
    dice, name = random.Random("%d %s" % (seed, with_truth)), "basin%d%d" % (seed, with_truth)
    bound = Bound.of(dice)
    where = [dice.uniform(1.2, 4.5) for _ in range(3)] + [dice.choice([2.0, 9.0])], [dice.uniform(0, 360) for _ in range(4)]
    dumped, capture = bench.write(name + ".txt", dump(dice, where)), bench.path(name + ".mcap")
    path, tuned_path = bench.write(name + ".conf", settings(dice)), bench.path(name + "-tuned.conf")
    done = bench.run(SONARCTL, "capture", "import", "--sensor", "box", dumped, capture)
    check(done.returncode == 0, done.stderr)
    fine, turn_s = played(bench, capture, path, "fine"), TURN * (0.042 + RANGE_M / 750)
    truth, tune_on = truth_of(where, turn_s), 80 if with_truth else 60
    more = ["--reference", bench.write("truth", truth)] if with_truth else []
    done = bench.run(TUNE, "--sonard", SONARD, "-c", path, "-o", tuned_path, *bound.arguments(), "--every", EVERY_S, "--tune-on",
                     str(tune_on), *more, capture, limit_s=240)
    why = with_truth and must_refuse(bound, truth, fine, turn_s, tune_on)
    check((done.returncode != 0) == bool(why), "SEED=%d: %s: %s; %s" % (seed, bound, done.stderr, why))
    if why:
        check("hold" in done.stderr and not os.path.exists(tuned_path), "SEED=%d: %s" % (seed, done.stderr))
        note("SEED=%d: %s: refused: %s" % (seed, bound, why))
        return
    os.mkdir(path + ".d")
    os.rename(tuned_path, os.path.join(path + ".d", "60-tuned.conf"))
    tuned = played(bench, capture, path, "coarse")
    check(len(fine) == len(tuned) and {line[1] for line in tuned} == {"main", "other"},
          "lines: %d and %d" % (len(fine), len(tuned)))
    rest = [(a, b) for x, y in zip(fine, tuned) if not with_truth or x[:2] != HORIZON
            for a, b in zip(x[2]["sectors"], y[2]["sectors"])]
    broken = bound.broken(rest, False) or with_truth and bound.broken(told_pairs(truth, tuned, turn_s), True)
    check(not broken, "SEED=%d: %s: %s" % (seed, bound, broken))
    note("SEED=%d: %s: %s" % (seed, bound, done.stdout.split("memory by")[1].splitlines()[1].strip()))


def basin_alone(bench):
    for seed in range(SEED, SEED + BASINS):
        basin(bench, seed, False)


def basin_with_truth(bench):
    for seed in range(SEED, SEED + BASINS):
        basin(bench, seed, True)


def map_service_are_left(bench):
    """With a map whose places are asked nothing changes what is heard; when only directions are asked the map goes."""
    path = bench.write("map.conf", "[sonar box]\ndevice = ping360\nport = serial:/dev/x:115200\nrange = 2 m\n"
                       "[map]\nvoxel = 0.2 m\nmemory = 16 MiB\n")
    for more, gone in (((), False), (("--directions",), True)):
        done = tune(bench, "-c", path, *more, out="map%d" % gone)
        check(done.returncode == 0, done.stderr)
        text = read(bench, "map%d" % gone)
        check(("voxel = none" in text) == gone and ("marks = off" in text) == gone, text)


# ---- judging and the search by themselves ----

def loaded():
    """sonard-tune as a module."""
    loader = SourceFileLoader("sonard_tune", TUNE)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("sonard_tune", loader))
    sys.modules["sonard_tune"] = module
    loader.exec_module(module)
    return module


def judges(_bench):
    """What one sector may say; and of a truth and the rest neither hides what is wrong with the other."""
    module = loaded()
    wall, clear, unknown = ("blocked", 2.0, 1.9), ("clear", None, 4.0), module.UNKNOWN
    nearer, farther, beyond = ("blocked", 1.0, 0.9), ("blocked", 2.5, 2.05), ("unknown", None, 2.5)

    def part(told, rest):
        pairs = [(types.SimpleNamespace(where=where, sectors=[a for a, _ in sectors]),
                  types.SimpleNamespace(sectors=[b for _, b in sectors])) for where, sectors in (("told", told), ("rest", rest))]
        return module.Part(pairs, 0.1, {"told"})

    for want, got, told_good, rest_good in ((wall, clear, False, False), (wall, beyond, False, False),
                                            (wall, ("clear", 2.05, 2.05), False, False), (wall, ("clear", 2.05, 1.5), True, True),
                                            (wall, ("blocked", 2.05, 2.2), False, False), (unknown, clear, True, False),
                                            (wall, unknown, True, True), (wall, nearer, True, True), (clear, wall, True, True)):
        check((part([(want, got)], []).holds(0, 100), part([], [(want, got)]).holds(0, 100)) == (told_good, rest_good),
              "%s, %s" % (want, got))
    for bad in ((wall, nearer), (wall, farther), (wall, unknown), (clear, unknown), (clear, wall)):
        many, few = [(wall, wall)] * 1000, [bad] * 10
        check(part(many, many).holds(95, 5) and not part(few, many).holds(95, 5) and not part(many, few).holds(95, 5), str(bad))


def made_up_answers(bad=(), late=()):
    """Ten lines of a hundred sectors with a wall 2 m away; the first of each line are what is given, of the last four lines `late`."""
    wall = ("blocked", 2.0, 1.9)
    return [types.SimpleNamespace(where="w", t=float(t), sectors=[*said, *[wall] * (100 - len(said))])
            for t, said in enumerate([bad] * 6 + [late] * 4)]


def checks(_bench):
    """Each check by itself: the bound tighter by the margin where it is tuned, the bound on the rest, and both as it is written."""
    module = loaded()
    tuner = module.Tuner.__new__(module.Tuner)
    tuner.args = types.SimpleNamespace(within=0.1, share=90, lost=10, margin=20, tune_on=60)
    tuner.reference, tuner.told = made_up_answers(), set()
    tuner.sonard = types.SimpleNamespace(with_keys=lambda keys: keys, answers=lambda keys: keys)
    far, near, gone, clear = ("blocked", 2.2, 2.0), ("blocked", 2.09, 2.0), module.UNKNOWN, ("clear", None, 2.1)
    for bad, where_tuned, on_the_rest in (([], (True, True, True), (True, True, True)),
                                          ([far] * 7, (True, True, True), (True, True, True)),
                                          ([far] * 9, (False, True, True), (True, True, True)),
                                          ([far] * 11, (False, True, False), (True, False, False)),
                                          ([near] * 50, (False, True, False), (True, True, True)),
                                          ([gone] * 7, (True, True, True), (True, True, True)),
                                          ([gone] * 9, (False, True, True), (True, True, True)),
                                          ([gone] * 11, (False, True, False), (True, False, False)),
                                          ([clear], (False, True, False), (True, False, False))):
        for answers, want in ((made_up_answers(bad), where_tuned), (made_up_answers(late=bad), on_the_rest)):
            parts = tuner.measure(answers)
            got = tuner.holds_tuned(parts), tuner.holds_checked(parts), tuner.holds_as_written(answers)
            check(got == want, "%d of %s: %s" % (len(bad), bad[:1], got))
    check(not tuner.holds_tuned(None) and not tuner.holds_checked(None), "what sonard refuses holds")


def takes_back(_bench):
    """What holds only where it was tuned, or not as it is written, is not taken; nothing is when nothing holds."""
    module = loaded()
    tuner = module.Tuner.__new__(module.Tuner)
    tuner.args = types.SimpleNamespace(share=90, lost=10)
    good, bad = (types.SimpleNamespace(holds=lambda *_, held=held: held) for held in (True, False))
    tuned = {"careful": [good, good], "as written": [good, good], "rest": [good, bad]}
    written = {"careful": [good, good], "as written": [bad, good], "rest": [good, good]}
    tuner.measure = written.get
    tuner.descend = lambda: list(tuned.items())
    check(tuner.best() == ("careful", tuned["careful"], 2), tuner.best())
    tuner.descend = lambda: list(tuned.items())[1:]
    try:
        check(False, tuner.best())
    except module.Refused as why:
        check("whatever the settings" in str(why), why)


def refers(_bench):
    """An answer is held against the last line of the reference about its place; what the truth tells nothing of is left to the most
    careful settings, and room is tried with half of it."""
    module = loaded()

    def line(where, t, said=module.UNKNOWN):
        return types.SimpleNamespace(where=where, t=t, sectors=[said])

    first, second, other = line("a", 1), line("a", 5), line("b", 2)
    answers = [line("a", 0.5), line("a", 1), line("b", 1.5), line("a", 4.9), line("b", 5), line("a", 5), line("c", 6)]
    check(module.pair([first, other, second], answers) == [(first, answers[1]), (first, answers[3]), (other, answers[4]),
                                                           (second, answers[5])], "pairs")
    careful = [line("a", 1), line("b", 1), line("b", 3)]
    check(module.completed([second], careful) == ([careful[1], careful[2], second], {"a"}), "the truth and the rest")
    asked = {("grid", "max_cells"): "65536", ("grid far", "max_cells"): "1500", ("grid", "angular_step"): "2 deg"}
    check(module.scarce(asked) == {**asked, ("grid", "max_cells"): "32768", ("grid far", "max_cells"): "1024"}, module.scarce(asked))
    values = {("grid", "angular_step"): "3 deg", ("grid", "max_cells"): "4096", ("grid", "sensor_model"): "midpoint",
              ("grid", "elevation"): "full", ("map", "voxel"): "none", ("extract", "detector"): "os",
              **{("extract", key): "on" for key in module.SWITCHES}}
    careful = {key: steps[0] for key, steps in module.ladders(values, True, False).items()}
    check(careful == {k: v for k, v in values.items() if k[0] != "map"} |
          {("grid", "angular_step"): "1 deg", ("grid", "max_cells"): "65536"}, careful)
    made = []
    sonard = types.SimpleNamespace(with_keys=lambda keys: made.append(keys), answers=lambda _: made_up_answers())
    tuner = module.Tuner(sonard, {("a", "b"): ["careful", "cheap"]}, [], None)
    check(made == [{("a", "b"): "careful"}] and len(tuner.reference) == 10, made)
    check(module.spelled({("grid", "x"): "1", ("grid far", "x"): "2"}, {("grid", "x"): "3"}, {("grid", "x"): "3"}) ==
          {("grid", "x"): "3", ("grid far", "x"): "2"}, "a named grid has another value than it had")


def names_old_poses(bench):
    """A capture that tells too little because the poses in it are too old is refused with that reason; else nothing is said of them."""
    module = loaded()
    lines = [{"sectors": {"t_unix": t, "pose_age_s": age, "sectors": [{"state": "unknown", "free_to_m": 0}]}}
             for t, age in enumerate((0.2, None, 1.5, 7))]
    said = module.read_answers(bench.write("answers", "".join(json.dumps(line) + "\n" for line in lines)))
    check("in 2 of 4 answers the pose was older than [pose] max_age, 1 s," in module.old_poses(said, "1 s"), module.old_poses(said, "1 s"))
    check("in 2 of 4 answers the pose was older than 1 s ([pose] max_age = auto)," in module.old_poses(said, "auto"), "auto")
    check(module.old_poses(said, "10 s") == "" and module.old_poses([], "1 s") == "", "poses that are new enough")
    tuner = module.Tuner.__new__(module.Tuner)
    tuner.careful, tuner.reference, tuner.sonard = {}, said, types.SimpleNamespace(values={("pose", "max_age"): "1 s"})
    tuner.measure_known = lambda _: [types.SimpleNamespace(known=0)] * 2
    try:
        check(False, tuner.descend())
    except module.Refused as why:
        check("tells too little" in str(why) and "2 of 4" in str(why), why)


def finds_sonard(bench):
    """In the source tree the one that make has built, and before it an installed one."""
    for folder in ("python", "build", "sbin"):
        os.makedirs(bench.path("tree/" + folder))
    tool = shutil.copy(TUNE, bench.path("tree/python"))
    os.symlink(os.path.join(TOP, "python", "sonard_tool.py"), bench.path("tree/python/sonard_tool.py"))
    for folder in ("build", "sbin"):
        os.chmod(bench.write("tree/%s/sonard" % folder, "#!/bin/sh\necho that of %s >&2; exit 1\n" % folder), 0o755)
        done = bench.run(tool, "-o", bench.path("tuned.conf"), CAPTURE)
        check(done.returncode == 1 and "that of " + folder in done.stderr, done.stderr)


def made_up(module, dice):
    """A tuner whose costs and whose bound are made up: cheaper keys interact, and dearer ones may allow cheaper others."""
    ladder = {("a", str(k)): [str(v) for v in range(dice.choice([2, 3, 5]))] for k in range(4)}
    combos = [dict(zip(ladder, v)) for v in itertools.product(*ladder.values())]
    careful = combos[0]
    good = {module.name(c): c == careful or dice.random() < 0.3 for c in combos}
    cost = {module.name(c): (sum(dice.uniform(0, 1) for _ in c) if c != careful else 9, 0) for c in combos}
    tuner = module.Tuner.__new__(module.Tuner)
    tuner.ladder, tuner.careful, tuner.measured, tuner.steps, tuner.shown = ladder, careful, {}, 0, 0.0
    tuner.args = types.SimpleNamespace(jobs=dice.choice([1, 3]))
    tuner.cost = lambda keys: cost[module.name(keys)]
    tuner.measure = lambda keys: [types.SimpleNamespace(known=99, good=good[module.name(keys)])]
    tuner.holds_tuned = lambda parts: parts[0].good
    return tuner, combos, good, cost


def search(_bench):
    """Every step holds and costs less; nothing one key from the end, or two by a step each, is cheaper and holds."""
    module = loaded()
    module.scarce = lambda keys: keys
    for n in range(20):
        tuner, combos, good, cost = made_up(module, random.Random("%d %d" % (SEED, n)))
        way = [module.name(keys) for keys, _ in tuner.descend()]
        check(tuner.shown == 1 and tuner.steps == len(way), "SEED=%d %d: the bar ends at %g" % (SEED, n, tuner.shown))
        check(all(good[w] for w in way) and sorted(way, key=lambda w: cost[w], reverse=True) == way,
              "SEED=%d %d: %s" % (SEED, n, way))
        last = dict(way[-1])
        better = [c for c in combos if good[module.name(c)] and cost[module.name(c)] < cost[way[-1]]
                  and (sum(c[k] != last[k] for k in c) <= 1 or sorted(abs(int(c[k]) - int(last[k])) for k in c) == [0, 0, 1, 1])]
        check(not better, "SEED=%d %d: %s ends dearer than %s" % (SEED, n, way, better))


check(os.path.isdir(BUILD), "no build")
run([("tune_" + f.__name__, f) for f in (holds, repeats, refuses, truth_holds, needs_no_folder, basin_alone, basin_with_truth,
                                         map_service_are_left, judges, checks, takes_back, refers, names_old_poses, finds_sonard, search)],
    gate=("tune_judges", "tune_checks", "tune_takes_back", "tune_refers", "tune_names_old_poses", "tune_finds_sonard", "tune_search"))
