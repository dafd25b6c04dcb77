#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""
bench.py - all measurements in one run: a table for people, and the same with everything else as JSON in BUILD/bench.json.
First how cost grows with each size until one processor no longer keeps up, in time and, with valgrind, in instructions; then ratios to what the same machine needs for
memory, a plain loop, a bare socket echo and OctoMap, then what a Raspberry Pi 4 would need (an estimate), then every
benchmark by itself (run.sh). Compare figures of one run only: machines and their neighbours differ.

  bench.py [quick|long]      quick: few repetitions, and not every benchmark by itself; long: these with all sizes, as long as it takes
"""
import csv
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

BUILD = os.environ.get("BUILD", "build")
HERE = os.path.dirname(os.path.abspath(__file__))

# A Cortex-A72 at 1.5 GHz does about one instruction of such code per cycle (0.7 to 1.5 measured by others), and its memory
# takes in changed bytes at about 2 GB/s. Together an estimate within a factor of 2.
PI_HZ, PI_BYTES_PER_S = 1.5e9, 2e9

# Stage; the function that is counted; repetitions; bytes of a map that one ping changes (what does not fit the Pi's cache);
# where and how often a ping comes.
STAGES = [
    ("extract", "extract_run", 200, 0, "1000 bins, 25 a second", 25),
    ("sphere", "sphere_enter", 400, 0, "directions of 2 degrees, 25 a second", 25),
    ("voxel", "submap_cast", 400, 2267, "voxels of 0.1 m to 6 m, 25 a second", 25),
]


def program(name):
    return os.path.join(BUILD, "tests", name)


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as f:
        cpu = re.search(r"model name\s*: (.*)", f.read())
    cc = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    return f"{os.uname().machine}, {cpu[1] if cpu else 'unknown CPU'}, {os.cpu_count()} CPUs, {cc}"


def scaling(quick):
    """Rows of numbers where they are numbers."""
    out = subprocess.run([program("bench_scaling")] + (["quick"] if quick else []), capture_output=True, text=True,
                         check=True).stdout
    rows = list(csv.DictReader(out.splitlines()))
    for row in rows:
        for key in ("value", "ns_median", "ns_low", "ns_high", "asked_per_s", "share", "times"):
            row[key] = float(row[key])
        row["keeps_up"] = row["keeps_up"] == "1"
    counts = count_scaling() if shutil.which("valgrind") else {}
    ping = counts.get(("pings a second", first(rows, "pings a second")["value"]))  # however often it comes
    return [row | {"instructions": ping if row["what"] == "pings a second" else counts.get((row["what"], row["value"]))}
            for row in rows]


def count_scaling():
    """Instructions of each row that is counted, by what and how large it is."""
    with tempfile.TemporaryDirectory() as folder:
        dump = os.path.join(folder, "dump")
        out = subprocess.run(["valgrind", "-q", "--tool=callgrind", "--toggle-collect=measured", "--dump-after=measured",
                              f"--callgrind-out-file={dump}", program("bench_scaling"), "counted"], stdout=subprocess.PIPE,
                             stderr=subprocess.DEVNULL, text=True, check=True).stdout
        counts = {}
        for i, row in enumerate(csv.DictReader(out.splitlines()), 1):
            with open(f"{dump}.{i}", encoding="utf-8") as f:
                total = int(re.search(r"^totals: (\d+)", f.read(), re.M)[1])
            counts[row["what"], float(row["value"])] = total / float(row["times"])
    return counts


def print_scaling(rows):
    print(f"\n{'what':26} {'size':>9} {'':12} {'ns':>11} {'quarters':>21}  {'per':9} {'ns/unit':>9} {'instr.':>10} "
          f"{'per unit':>9}  of one processor")
    last = None
    for row in rows:
        group = row["what"].partition(":")[0]
        if last and group != last:
            print()
        last = group
        units = row["value"] if row["what"] != "pings a second" and row["per"] in ("ping", "beam") else 1
        instructions = row["instructions"]
        share = f"{100 * row['share']:.3g} % at {row['asked_per_s']:g}/s" if row["asked_per_s"] else ""
        print(f"{row['what']:26} {row['value']:9.0f} {row['unit']:12} {row['ns_median']:11.0f} "
              f"{row['ns_low']:10.0f}-{row['ns_high']:<10.0f}  {row['per']:9} "
              f"{row['ns_median'] / units:9.3g} {f'{instructions:.0f}' if instructions else '':>10} "
              f"{f'{instructions / units:.3g}' if instructions else '':>9}  "
              f"{share}{'' if row['keeps_up'] else ': does not keep up'}")
    print("\nA question: from its line to the answer's in the loop. With clients it goes over a socket: threads and calls of the system,\n"
          "whose instructions are not counted.\n"
          "\nhow far one processor keeps up, where a size was doubled:")
    for what in dict.fromkeys(row["what"] for row in rows):
        doubled = [row for row in rows if row["what"] == what]
        if len(doubled) > 1:
            text = "all of its range, up to" if doubled[-1]["keeps_up"] else "less than"
            print(f"  {what:26} {text} {doubled[-1]['value']:.0f} {doubled[-1]['unit']}")


def first(rows, what, value=None):
    return next(r for r in rows if r["what"] == what and value in (None, r["value"]))


def peer():
    """Cost over OctoMap's, by scene; empty, with a sentence, where its library is not installed or it does not run."""
    path = program("bench_octomap_peer")
    done = subprocess.run([path], capture_output=True, text=True, check=False) if os.path.exists(path) else None
    if not done or done.returncode:
        print(f"\nno ratios to OctoMap: {path} {f'ended with status {done.returncode}' if done else 'is not built'}")
        return {}
    return {f"voxel map, scene {m[1]} {m[2]} m, to OctoMap": 1 / float(m[3])
            for m in re.finditer(r"^([A-Z])\s+([\d.]+) m\s+([\d.]+)\s+\d+\s+\d+$", done.stdout, re.M)}


def ratios(rows):
    """Each the cost here over the cost of the other, in this run: below 1 is faster."""
    memory = first(rows, "adding one to bytes in memory")["ns_median"] / 2**20
    whole, plain = first(rows, "pings a second")["ns_median"], first(rows, "a plain detector loop")["ns_median"]
    echo = first(rows, "a bare echo over a socket")["ns_median"]
    voxels = [r for r in rows if r["what"] == "voxels"]
    return {"a ping through all stages, to the plain detector loop over its bins": whole / plain,
            "'blocked' over the socket, one client, to a bare echo": first(rows, "clients", 1.0)["ns_median"] / echo,
            f"a voxel of {voxels[-1]['value']:.0f} a ping, to adding one to a byte in memory":
                voxels[-1]["ns_median"] / voxels[-1]["value"] / memory} | peer()


def instructions(stage, function, times):
    with tempfile.NamedTemporaryFile("r") as log:
        subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", f"--log-file={log.name}",
                        f"--toggle-collect={function}", program("bench_scaling"), stage, str(times)], check=True,
                       stdout=subprocess.DEVNULL)
        return int(re.search(r"Collected : (\d+)", log.read())[1]) / times


def raspberry_pi(scaled):
    """Instructions that were counted here (x86-64), taken as many there."""
    if not shutil.which("valgrind"):
        print("\nno estimate for a Raspberry Pi: valgrind is not installed")
        return []
    rows = []
    for stage, function, times, changed, what, rate in STAGES:
        n = instructions(stage, function, times)
        ns = 1e9 * max(n / PI_HZ, changed / PI_BYTES_PER_S)
        rows.append({"stage": stage, "what": what, "instructions": n, "ns_estimated": ns, "share": ns * 1e-9 * rate})
    for row in scaled:
        if row["what"].startswith("question: "):
            n, rate = row["instructions"], row["asked_per_s"]
            rows.append({"stage": row["what"].removeprefix("question: "), "what": f"a question, {rate:g} a second", "instructions": n,
                         "ns_estimated": 1e9 * n / PI_HZ, "share": n / PI_HZ * rate})
    return rows


def by_itself(begin, long):
    """Every benchmark's own words, shown as they come, and when each began: {program: [line]}."""
    words, name = {}, "machine"
    with subprocess.Popen([os.path.join(HERE, "run.sh")], stdout=subprocess.PIPE, text=True,
                          env={**os.environ, "LONG": "1" if long else ""}) as run:
        for line in run.stdout:
            if line.startswith("== "):
                name = line[3:].strip()
                line = f"== {name}, {time.monotonic() - begin:.0f} s after the begin\n"
            print(line, end="", flush=True)
            words.setdefault(name, []).append(line.rstrip("\n"))
    if run.returncode:
        sys.exit(f"bench.py: run.sh: ended with status {run.returncode}")
    return words


def main():
    quick, begin = sys.argv[1:] == ["quick"], time.monotonic()
    result = {"machine": machine(), "scaling": scaling(quick)}
    print(result["machine"])
    print_scaling(result["scaling"])
    result["ratios"] = ratios(result["scaling"])
    print("\nratios in this run (below 1: faster than what it is held against)")
    for what, ratio in result["ratios"].items():
        print(f"  {ratio:10.3g}  {what}")
    result["raspberry_pi_4_estimate"] = raspberry_pi(result["scaling"])
    if result["raspberry_pi_4_estimate"]:
        print("\na Raspberry Pi 4, estimated within a factor of 2 from instructions counted here and its memory, not measured")
    for row in result["raspberry_pi_4_estimate"]:
        print(f"  {row['stage']:8} {row['instructions']:9.0f} instructions  {1e-3 * row['ns_estimated']:7.1f} us each  "
              f"{100 * row['share']:.2g} % of a core: {row['what']}")
    if not quick:
        result["programs"] = by_itself(begin, sys.argv[1:] == ["long"])
    result["seconds"] = time.monotonic() - begin
    path = os.path.join(BUILD, "bench.json")
    with open(path, "w", encoding="utf-8") as f:
        json.dump(result, f, indent=1)
    print(f"\n{path}, after {result['seconds']:.0f} s")


main()
