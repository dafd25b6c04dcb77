#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""
plan_error.py [--all] - the cost model of `sonard --explain` against what callgrind counts, for a few settings or --all of them:
a row for each stage, counted over predicted, and for each stage the median and the worst factor. A test fails where a stage is
off by more than FACTOR. Instructions: they repeat on a noisy machine. What is counted:

  bytes    what bench_devices has every device read
  box      a recording of single beams of 1200 bins between the walls of a narrow channel, replayed, without poses
  priced   the pings that the model is about, made by report_priced: of every head, opening, map; beams side by side; with a pose
  moving   the same all around a vehicle that drives 1 m/s, so that the grids' centre follows with every third ping

Not counted: a template.
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
CAPTURE, CAPTURED = os.path.join(TOP, "tests", "replay", "box.mcap"), 101
SONARD = os.path.join(BUILD, "sonard")
FACTOR = 3.0  # as sonard(8) says

# Stages of the plan that are counted together, and the functions that do their work.
STAGES = {
    "extract": ({"extract"}, {"extract_run"}),
    "cleanup": ({"cleanup"}, {"cleanup_put", "cleanup_next"}),
    "marks": ({"marks"}, {"marks_run"}),
    "image": ({"image"}, {"image_enter"}),
    "grid": ({"grid", "elevation"}, {"sphere_enter"}),
    "relaxation": ({"relaxation"}, {"relax_reach", "relax_direction"}),
    "map": ({"map"}, {"voxmap_enter"}),
}
INSIDE = {"grid": "relaxation"}  # the functions of the one call those of the other

OPENINGS = ("2 25", "10 10", "30 5", "30 30")
BOX = ["aperture = %s deg\n[grid]\nangular_step = %g deg\nsensor_model = %s\nelevation = %s\n" %
       (aperture, step, model, elevation) for aperture in OPENINGS[:3] for elevation in ("full", "level")
       for model in ("opening", "midpoint", "gauss") for step in (1, 3, 8)]
BOX += ["[extract]\ndetector = %s\n" % d for d in ("ca", "soca", "os")]
CLEANUPS = ["[extract]\n" + keys for keys in ("otsu = on\n", "median = 3\nclasses = on\n", "median = 5\notsu = on\nclahe = on\n",
                                             "median = 3\notsu = on\nclahe = on\nclasses = on\n")]
BOX += CLEANUPS

HEAD = "[sonar a]\ndevice = %s\nport = %s\nrange = %g m\n"
SERIAL = "serial:/dev/null:115200"
HEADS = [("ping360", SERIAL, 30), ("micron", SERIAL, 30), ("imagenex852", SERIAL, 30), ("imagenex881a", SERIAL, 30),
         ("ping1d", SERIAL, 30), ("echolist", SERIAL, 30), ("dronecan", "can:can0", 30), ("surveyor", "udp:192.0.2.1:1", 4)]
PRICED = [(n, HEAD % (device, port, 20) + "[grid]\nrelaxation = 0.5\n[map]\nvoxel = 0.2 m\n") for device, port, n in HEADS]
PRICED += [(30, HEAD % ("ping360", SERIAL, 20) + "aperture = %s deg\n[grid]\nangular_step = %g deg\nelevation = %s\n"
            "relaxation = 0.5\nsensor_model = %s\n" % (aperture, step, elevation, model)) for aperture in OPENINGS
           for step, model in ((1, "opening"), (3, "gauss"), (8, "midpoint")) for elevation in ("full", "level")]
PRICED += [(10, HEAD % ("ping360", SERIAL, voxels * voxel_m) + "aperture = %s deg\nrotation = %g 0 0 deg\n[grid]\n"
            "elevation = level\n[map]\nvoxel = %g m\nechoes = %s\nheight = 8 m\n" % (aperture, roll, voxel_m, echoes))
           for aperture in ("1 1", *OPENINGS) for voxels, voxel_m in ((10, 0.5), (50, 0.1), (150, 0.1))
           for roll, echoes in ((0, "on"), (0, "off"), (45, "on"), (90, "on"), (90, "off"))]
PRICED += [(60, HEAD % (device, SERIAL, 20) + c) for device in ("ping360", "micron", "imagenex852") for c in CLEANUPS]
LEVEL = "[grid]\nelevation = level\n"
MOVING = [(400, HEAD % (device, SERIAL, 20) + c) for device in ("ping360", "micron") for c in
          (LEVEL, "", "[grid]\nangular_step = 4 deg\nsensor_model = gauss\n")]
MOVING += [(9, HEAD % ("surveyor", "udp:192.0.2.1:1", 20) + c) for c in (LEVEL, "[map]\nvoxel = 0.2 m\n")]
FOLLOWS, MPS = 1 / 3, "1"  # pings in which the grids' centre follows, at that speed


def predicted(conf, options):
    plan = json.loads(subprocess.run([SONARD, "-c", conf, *options, "--explain=json"], capture_output=True, check=True).stdout)
    cost = {s["name"]: s["instructions"] for s in plan["stages"] if s["in"]}
    return {stage: sum(cost.get(name, 0) for name in names) for stage, (names, _) in STAGES.items()}, cost


def counted(out, pings, *command):
    """Instructions of a ping in each stage, from the last part that callgrind wrote before the program ended its work."""
    subprocess.run(["valgrind", "-q", "--tool=callgrind", "--callgrind-out-file=" + out, "--dump-before=cost_mark", *command],
                   check=True, stderr=subprocess.DEVNULL)
    part = out + ".2" if os.path.exists(out + ".2") else out
    table = subprocess.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", part], capture_output=True, text=True,
                           check=True).stdout
    of = {}
    for n, name in re.findall(r"^ *([\d,]+) .*:(\w+)(?: \[|$)", table, re.M):  # more than once, where parts of it come from headers
        of[name] = max(of.get(name, 0), int(n.replace(",", "")) / pings)
    sums = {stage: sum(of.get(f, 0) for f in functions) for stage, (_, functions) in STAGES.items()}
    return {stage: n - sums.get(INSIDE.get(stage), 0) for stage, n in sums.items()}


def rows(source, pings, setting, text, options, command):
    """(stage, counted over predicted) of every stage that the configuration has, printed."""
    with tempfile.TemporaryDirectory() as folder:
        conf = os.path.join(folder, "conf")
        with open(conf, "w", encoding="ascii") as f:
            f.write(text)
        want, cost = predicted(conf, options)
        got = counted(os.path.join(folder, "out"), pings, *command(conf))
    if source == "moving":
        want["grid"] += FOLLOWS * cost["motion"]
    for stage in (s for s in want if want[s] > 0):
        yield from row(source, stage, got[stage], want[stage], setting)


def row(source, stage, got, want, setting):
    print("%-7s %-10s %9.0f counted %9.0f predicted %6.2f  %s" % (source, stage, got, want, got / want,
          " ".join(setting.split("\n")).replace(" = ", "=")), flush=True)
    yield stage, got / want


def device_rows(device, port):
    """The same of the device's bytes, by the bin and by the beam: bench_devices has smaller pings than the plan, of some."""
    with tempfile.TemporaryDirectory() as folder:
        conf, out = os.path.join(folder, "conf"), os.path.join(folder, "out")
        with open(conf, "w", encoding="ascii") as f:
            f.write(HEAD % (device, port, 20))
        _, cost = predicted(conf, ())
        done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--log-file=" + out,
                               "--toggle-collect=feed_all*", os.path.join(BUILD, "tests", "bench_devices"), device],
                              check=True, capture_output=True, text=True)
        with open(out, encoding="ascii") as f:
            got = int(re.search(r"Collected : (\d+)", f.read())[1])
    frames, share = map(float, done.stdout.split())
    yield from row("bytes", "device", got / frames, cost["device"] * share, device)


def main():
    if not shutil.which("valgrind"):
        sys.exit(print("skip plan_error: no valgrind"))
    every = 1 if sys.argv[1:] == ["--all"] else 11
    with open(os.path.join(TOP, "tests", "replay", "box.conf"), encoding="ascii") as f:
        box = f.read()
    found = []
    alone = ("--socket", "none")  # no image for anybody
    for s in BOX[::every]:
        found += rows("box", CAPTURED, s, box + s, alone,
                      lambda conf: (SONARD, "--replay", CAPTURE, "-c", conf, "--threads", "0", *alone))
    for pings, s in PRICED[::every]:
        found += rows("priced", pings, s, s, (), lambda conf, n=pings: (os.path.join(BUILD, "tests", "report_priced"), conf, str(n)))
    for pings, s in MOVING[::every]:
        found += rows("moving", pings, s, s, (), lambda conf, n=pings: (os.path.join(BUILD, "tests", "report_priced"), conf, str(n), MPS))
    for device, port, _ in [h for h in HEADS if h[0] != "imagenex881a"][::every]:  # which speaks as the 852 does
        found += device_rows(device, port)
    bad = False
    for stage in ("device", *STAGES):
        off = sorted(max(f, 1 / f) if f > 0 else float("inf") for s, f in found if s == stage)
        good = len(off) > 0 and off[-1] <= FACTOR
        bad |= not good
        print("%s plan_error_%s: off by a factor of %.2f in the median, %.2f at worst, of %d\n" %
              ("ok" if good else "FAIL", stage, statistics.median(off or [0]), max(off, default=0), len(off)))
    sys.exit(bad)


main()
