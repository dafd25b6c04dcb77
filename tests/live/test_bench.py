#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""bench.py on made-up benchmarks: its table and its JSON say what they printed, ratios and the estimate for a Raspberry Pi are
those of the figures, and a peer or a valgrind that is not there or does not run costs its own part only."""
import json
import os
import shutil
import subprocess
import sys

from lib import ALL, check, run

TOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
SCALING = """what,value,unit,per,ns_median,ns_low,ns_high,asked_per_s,share,keeps_up,times
adding one to bytes in memory,64,MiB,MiB,1048576,1000000,1100000,0,0,1,64
a plain detector loop,1000,bins,beam,8000,7900,8100,25,0.0002,1,20
pings a second,25,pings/s,ping,4000,3900,4100,25,0.0001,1,200
pings a second,50,pings/s,ping,4000,3900,4100,50,0.0002,1,200
beams,1,beams,ping,500,490,510,40,2e-05,1,4
beams,2,beams,ping,30000000,29000000,31000000,40,1.2,0,4
voxels,100,voxels/ping,ping,50,49,51,25,1e-06,1,200
voxels,200,voxels/ping,ping,600,590,610,25,1e-05,1,200
question: blocked,1,clients,question,700,690,710,20,1.4e-05,1,100
a bare echo over a socket,1,clients,question,5000,4900,5100,20,0.0001,1,0
clients,1,clients,question,10000,9900,10100,20,0.0002,1,0
"""
PEER = "scene voxel ratio\nA  0.2 m  400.0  12  13\nB  0.5 m  2000  1  2\n"
# Callgrind of a stage: 3000 instructions each time. Of all rows: the n-th takes 1000 n in all; it stops before there are clients.
VALGRIND = """for a; do case $a in --log-file=*) log=${a#*=};; --callgrind-out-file=*) dump=${a#*=};; esac; program=$last last=$a; done
[ "$last" = counted ] || { echo "==1== Collected : $((3000 * last))" >"$log"; exit; }
n=0
"$program" counted | while read -r row; do
    case $row in a\\ bare*) break;; esac
    echo "$row"
    [ $n = 0 ] || echo "totals: $((1000 * n))" >"$dump.$n"
    n=$((n + 1))
done
"""


def script(bench, name, text):
    path = bench.path(name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="ascii") as f:
        f.write("#!/bin/sh\n" + text)
    os.chmod(path, 0o755)


def printing(text):
    return "cat <<'END'\n%sEND\n" % text


def benched(bench, valgrind, peer=None):
    """What bench.py prints and its JSON, of made-up programs."""
    script(bench, "tests/bench_scaling", printing(SCALING))
    if peer:
        script(bench, "tests/bench_octomap_peer", peer)
    if valgrind:
        script(bench, "bin/valgrind", VALGRIND)
    script(bench, "bin/cc", "echo cc 1\n")
    for name in ("sh", "cat"):
        os.symlink(shutil.which(name), bench.path("bin/" + name))
    done = subprocess.run([sys.executable, os.path.join(TOP, "tests", "bench", "bench.py"), "quick"], capture_output=True,
                          text=True, env={**os.environ, "BUILD": bench.path(""), "PATH": bench.path("bin")}, check=False)
    check(done.returncode == 0, done.stderr)
    with open(bench.path("bench.json"), encoding="utf-8") as f:
        return done.stdout, json.load(f)


def figures(bench):
    """Every row, ratio and estimate from what was printed."""
    text, result = benched(bench, True, printing(PEER))
    rows = result["scaling"]
    check(len(rows) == 11 and [r["keeps_up"] for r in rows].count(False) == 1 and rows[5]["ns_median"] == 3e7, rows)
    check("beams                      less than 2 beams" in text, text)
    check("pings a second             all of its range, up to 50 pings/s" in text, text)
    check("120 % at 40/s: does not keep up" in text, text)
    check([r["instructions"] for r in rows] == [1000 / 64, 2000 / 20, 3000 / 200, 3000 / 200, 5000 / 4, 6000 / 4, 7000 / 200,
                                                8000 / 200, 9000 / 100, None, None], rows)
    check(any(line.split()[:1] == ["voxels"] and line.split()[7:9] == ["40", "0.2"] for line in text.splitlines()), text)
    ratios = list(result["ratios"].values())
    check(all(abs(got - want) < 1e-9 for got, want in zip(ratios, (0.5, 2, 3, 1 / 400, 1 / 2000), strict=True)), result["ratios"])
    pi = {r["stage"]: r for r in result["raspberry_pi_4_estimate"]}
    check(list(pi) == ["extract", "sphere", "voxel", "blocked"] and [r["instructions"] for r in pi.values()] == [3000] * 3 + [90], pi)
    check(abs(pi["blocked"]["ns_estimated"] - 60) < 1e-9 and abs(pi["blocked"]["share"] - 1.2e-6) < 1e-12, pi)
    check(abs(pi["sphere"]["ns_estimated"] - 2000) < 1e-6 and abs(pi["sphere"]["share"] - 5e-5) < 1e-12, pi)
    check(result["seconds"] >= 0 and "programs" not in result, result.keys())


def nothing_to_compare(bench):
    """Neither OctoMap nor valgrind: the rest is there, and what is missing is named."""
    text, result = benched(bench, False)
    check(len(result["ratios"]) == 3 and result["raspberry_pi_4_estimate"] == [], result)
    check(all(r["instructions"] is None for r in result["scaling"]), result)
    check("no ratios to OctoMap" in text and "is not built" in text and "valgrind is not installed" in text, text)


def peer_fails(bench):
    text, result = benched(bench, True, "exit 127\n")
    check(len(result["ratios"]) == 3 and len(result["raspberry_pi_4_estimate"]) == 4, result)
    check("ended with status 127" in text, text)


run([("bench_" + f.__name__, f) for f in (figures, nothing_to_compare, peer_fails)], gate=ALL)
