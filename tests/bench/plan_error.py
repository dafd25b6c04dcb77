#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""
plan_error.py [--all] - the cost model of `sonard --explain` against what callgrind counts while the recording is replayed: a
row for each setting of a grid and of the detector, counted over predicted, and the median and the worst factor. A few settings,
and --all of them; a test fails where one is off by more than FACTOR. Instructions: they repeat on a noisy machine. The
recording is of single beams of 1200 bins between walls, without poses: it tells nothing of multibeam heads and of the map.
"""
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

BUILD = os.environ.get("BUILD", "build")
TOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
CAPTURE, PINGS = os.path.join(TOP, "tests", "replay", "box.mcap"), 101
FACTOR = 3.0  # as sonard(8) says

GRIDS = ["aperture = %s deg\n[grid]\nangular_step = %g deg\nsensor_model = %s\nelevation = %s\n" %
         (aperture, step, model, elevation) for aperture in ("2 25", "10 10", "30 5") for elevation in ("full", "level")
         for model in ("opening", "midpoint", "gauss") for step in (1, 3, 8)]
DETECTORS = ["[extract]\ndetector = %s\n" % d for d in ("ca", "soca", "os")]


def predicted(sonard, conf, names):
    plan = json.loads(subprocess.run([sonard, "-c", conf, "--explain=json"], capture_output=True, check=True).stdout)
    return sum(s["instructions"] for s in plan["stages"] if s["name"] in names and s["in"])


def counted(sonard, conf, function):
    with tempfile.NamedTemporaryFile("r") as log:
        subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--log-file=" + log.name,
                        "--toggle-collect=" + function, sonard, "--replay", CAPTURE, "-c", conf, "--socket", "none",
                        "--threads", "0"], check=True, stderr=subprocess.DEVNULL)
        return int(re.search(r"Collected : (\d+)", log.read())[1]) / PINGS


def factors(sonard, box, what, function, names, settings):
    """Counted over predicted, of each setting."""
    for setting in settings:
        with tempfile.NamedTemporaryFile("w", suffix=".conf") as conf:
            conf.write(box + setting)
            conf.flush()
            want, got = predicted(sonard, conf.name, names), counted(sonard, conf.name, function)
        print("%-8s %9.0f counted %9.0f predicted %6.2f  %s" %
              (what, got, want, got / want, " ".join(setting.split("\n")).replace(" = ", "=")), flush=True)
        yield got / want


def main():
    if not shutil.which("valgrind"):
        sys.exit(print("skip plan_error: no valgrind"))
    every = 1 if sys.argv[1:] == ["--all"] else 7
    with open(os.path.join(TOP, "tests", "replay", "box.conf"), encoding="ascii") as f:
        box = f.read()
    bad = False
    for what, function, names, settings in (("grid", "sphere_enter", ("grid", "elevation"), GRIDS[::every]),
                                            ("extract", "extract_run", ("extract",), DETECTORS[::every])):
        off = sorted(max(f, 1 / f) for f in factors(os.path.join(BUILD, "sonard"), box, what, function, names, settings))
        bad |= off[-1] > FACTOR
        print("%s plan_error_%s: off by a factor of %.2f in the median, %.2f at worst\n" %
              ("ok" if off[-1] <= FACTOR else "FAIL", what, statistics.median(off), off[-1]))
    sys.exit(bad)


main()
