#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""
report.py - makes the report: runs the measuring programs, plots, and writes build/report/index.html, build/report/report.md and
the data as CSV. The text is index.md and one file per chapter; a line that begins with @ is done and replaced:

  @chapter NAME                    the text of NAME.md
  @run DATA PROGRAM ARGS...        what the program prints becomes data/DATA.csv
  @time DATA PROGRAM ARGS...       the same, with nothing beside it: it measures nanoseconds
  @count DATA FUNCTION PROGRAM ARGS...  the same under callgrind: a column of instructions in FUNCTION between two
                                   calls of cost_mark, per `bins` of the row; empty where there is no valgrind
  @if_peer TEXT                    TEXT, where the benchmark's peer is built: a conclusion or a directive that rests on it
  @count_long DATA FUNCTION PROGRAM ARGS...  the same with LONG=1; otherwise the data has one empty row
  @sweep DATA ERRORS COUNT         one row per setting of report_sweep
  @peer DATA COLUMN[:TITLE]...     what the benchmark's peer says, as data and a table; a sentence where it is not built
  @points DATA ERRORS COST COUNT MEASURE[!][<LIMIT]... [+COLUMN]...  one row per setting: medians over seeds, cost, Pareto
                                   fronts; a setting beyond a limit is no use and on no front; a COLUMN has no front.
                                   A MEASURE with ! is dangerous: the worst of the seeds, and MEASURE_seeds says in how
                                   many of them it is above 0; where fewer than 8 seeds were run, the report fails.
                                   MEASURE_worse: in how many more seeds it is worse than the default than it is better
  @seeds DATA FROM MEASURE[!]...   one row per setting: medians over seeds, of what is dangerous the worst, as @points has it
  @claim EXPRESSION :: TEXT        TEXT, where EXPRESSION holds over the data (claims.py); else the run fails. {...} in TEXT,
                                   and in all other text of a line that begins with @say, is a figure from the data
  @stated FILE :: TEXT             TEXT with its figures must stand in FILE of the tree, else the run fails
  @judge DATA                      is the default on the front, and what does it give up, in words and a table
  @stays DATA KNOB=VALUE... :: EXPRESSION :: TEXT   a claim: why the default stays although these settings are better in all
                                   that @judge compares. The report fails where a better setting has none
  @plot SCRIPT                     gnuplot SCRIPT.gp, with `data` and `out` set
  @figure FILE CAPTION             FILE.svg
  @table DATA COLUMN=VALUE... COLUMN[:TITLE]...   rows where COLUMN is VALUE, the named columns
  @pivot DATA ROW COLUMN COLUMN=VALUE... CELL...  a row for each value of ROW, a column for each of COLUMN, cells joined by /
  @beside DATA LEFT RIGHT          the columns of LEFT and of RIGHT, whose rows are about the same, as data
  @explain SCENE                   the plan of config/scenes/SCENE.conf, as sonard --explain has it
  @machine                         what it was measured on

What runs programs is done first: on all processors at once, the longest before the others, and then, one by one, what
measures time.
"""
import argparse
import concurrent.futures
import csv
import itertools
import json
import math
import os
import platform
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import page
from claims import Claims, Missing, interval
from page import HERE, markdown_table, number, read


# What takes longest, begun first so that no processor waits for it at the end. Only the order depends on it.
LONGEST = ("long", "pilot_drives", "extract_count", "sweep_errors", "sphere_errors", "stock", "voxel_errors", "voxel_settings", "chain_errors",
           "voxel_maps", "stability", "chain_count", "detection_shaft", "target_waters", "detection_roc")


# Callgrind takes most of a quick run's time; one count is enough to try the machinery.
COUNTED_IN_QUICK = "saturated_count"


def unless_missing(conclude):
    """A quick run does not measure all that the text concludes from."""
    def within(report, *words):
        try:
            return conclude(report, *words)
        except Missing as missing:
            if report.size != "quick":
                raise
            return f"*Not measured in a quick run: {missing}.*"
    return within


class Report:
    def __init__(self, build, out, size):
        self.build, self.out, self.size = build, out, size
        self.data = os.path.join(out, "data")
        self.figures = 0
        self.cpu_s = {}
        self.broken = []
        self.better, self.explained = set(), set()
        self.begin = time.monotonic()
        shutil.rmtree(out, ignore_errors=True)
        os.makedirs(self.data)
        self.claims = Claims(self.data)

    # ---- data ----

    def rows(self, name):
        with open(os.path.join(self.data, name + ".csv"), newline="", encoding="utf-8") as f:
            return list(csv.DictReader(f))

    def save(self, name, rows):
        with open(os.path.join(self.data, name + ".csv"), "w", newline="", encoding="utf-8") as f:
            table = csv.DictWriter(f, rows[0].keys(), lineterminator="\n")
            table.writeheader()
            table.writerows(rows)

    def program(self, name, *args):
        return [os.path.join(self.build, "tests", name), *args, *([self.size] if self.size else [])]

    def spend(self, name, command):
        """Runs a command whose output becomes data; what it took of the processor is kept by the name of the data."""
        with open(os.path.join(self.data, name + ".csv"), "w", encoding="utf-8") as f:
            run = subprocess.Popen(command, stdout=f, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(run.pid, 0)
        run.returncode = os.waitstatus_to_exitcode(status)
        self.cpu_s[name] = used.ru_utime + used.ru_stime
        if run.returncode:
            raise subprocess.CalledProcessError(run.returncode, command)

    def run(self, name, *command):
        self.spend(name, self.program(*command))

    def count(self, name, function, *command):
        if not shutil.which("valgrind") or (self.size == "quick" and name != COUNTED_IN_QUICK):
            self.run(name, *command)
            self.save(name, [row | {"instructions": ""} for row in self.rows(name)])
            return
        with tempfile.TemporaryDirectory() as folder:
            dump = os.path.join(folder, "dump")
            valgrind = ["valgrind", "-q", "--tool=callgrind", f"--toggle-collect={function}",
                        "--dump-before=cost_mark", f"--callgrind-out-file={dump}"]
            self.spend(name, valgrind + self.program(*command))
            rows = self.rows(name)
            for i, row in enumerate(rows, 1):
                total = int(re.search(r"^totals: (\d+)", read(f"{dump}.{i}"), re.M)[1])
                row["instructions"] = f"{total / float(row['bins']):.2f}"
        self.save(name, rows)

    def count_long(self, name, function, *command):
        """Callgrind takes minutes: with LONG=1 only."""
        if self.size == "long":
            self.count(name, function, *command)
        else:
            self.save(name, [{"knob": "", "value": "", "section": "", "configuration": "", "instructions": ""}])

    def check_knobs(self, name):
        """Every row of a knob says what it ran, and no two rows of one ran the same."""
        rows = self.rows(name)
        if not rows or "knob" not in rows[0]:
            return
        if "configuration" not in rows[0]:
            sys.exit(f"report.py: {name}: rows of knobs do not say which configuration they ran")
        values = {}
        for row in rows:
            key = row["knob"], row["configuration"]
            if values.setdefault(key, row["value"]) != row["value"]:
                sys.exit(f"report.py: {name}: {key[0]} = {values[key]} and = {row['value']} ran the same: {key[1]}")

    def run_peer(self, name, *_):
        if os.path.exists(self.program("bench_octomap_peer")[0]):
            self.run(name, "bench_octomap_peer", "csv")

    def measure(self, texts):
        """Runs every program that the texts name; what measures time comes last, with nothing beside it."""
        steps = [m for text in texts for m in re.findall(r"^@(run|count|count_long|peer|time) (.*)$", text, re.M)]
        steps.sort(key=lambda step: (LONGEST + (step[1].split()[0],)).index(step[1].split()[0]))
        does = {"run": self.run, "count": self.count, "count_long": self.count_long, "peer": self.run_peer, "time": self.run}
        done = 0
        for alone in (False, True):
            with concurrent.futures.ThreadPoolExecutor(1 if alone else len(os.sched_getaffinity(0))) as pool:
                jobs = {pool.submit(does[kind], *words.split()): words.split()[0] for kind, words in steps
                        if (kind == "time") == alone}
                try:
                    for job in concurrent.futures.as_completed(jobs):
                        done += 1
                        job.result()
                        self.check_knobs(jobs[job])
                        self.progress(done, len(steps), f"{jobs[job]}, {self.cpu_s.get(jobs[job], 0):.1f} s of CPU")
                finally:
                    pool.shutdown(cancel_futures=True)

    def progress(self, done, steps, what):
        bar = "#" * (20 * done // steps)
        print(f"[{bar:20}] {done:2}/{steps} {time.monotonic() - self.begin:4.0f} s  {what}", flush=True)

    def peer(self, name, *columns):
        if not os.path.exists(os.path.join(self.data, name + ".csv")):
            return "Not measured here: the peer's library, liboctomap-dev, is not installed."
        return self.table(name, *columns)

    def if_peer(self, *words):
        return self.expand(" ".join(words)) if os.path.exists(self.program("bench_octomap_peer")[0]) else ""

    # ---- error against cost ----

    def points(self, name, errors, cost, count, *measures):
        seeds = {}
        for row in self.rows(errors):
            if row["scene"] == "all":
                seeds.setdefault((row["knob"], row["value"]), []).append(row)
        costs = {(r["knob"], r["value"]): r for r in self.rows(cost)}
        counts = {(r["knob"], r["value"]): r["instructions"] for r in self.rows(count)}
        shown = [word[1:] for word in measures if word.startswith("+")]
        limits = {m: float(limit or "inf") for m, _, limit in (word.partition("<") for word in measures if word[0] != "+")}
        dangerous = {m[:-1] for m in limits if m.endswith("!")}
        limits = {m.rstrip("!"): limit for m, limit in limits.items()}
        measures = list(limits)
        points = []
        default = next(rows for rows in seeds.values() if rows[0]["default"] == "1")
        for key, rows in seeds.items():
            place = sum(p["knob"] == key[0] for p in points)
            point = {"knob": key[0], "value": key[1], "place": place, "default": rows[0]["default"],
                     "configuration": rows[0]["configuration"],
                     "cost": counts[key] or costs[key]["ns_per_bin"], "instructions": counts[key]}
            point |= {k: costs[key][k] for k in ("ns_per_bin", "ns_low", "ns_high")}
            for m in measures + shown:
                point |= self.over_seeds(errors, m, [float(row[m]) for row in rows], m in dangerous)
                point[m + "_worse"] = worse_seeds(rows, default, m)
            points.append(point)
        useful = [p for p in points if all(float(p[m]) <= limit for m, limit in limits.items())]
        for p in points:
            p["useful"] = int(p in useful)
            for m in measures:
                p["front_" + m] = int(p in useful and not any(better(q, p, ["cost", m]) for q in useful))
        for m in measures:
            tell(points, m)
        self.save(name, points)
        return ""

    def over_seeds(self, name, measure, values, dangerous):
        """A measure's columns: of what is dangerous the worst and in how many seeds it is not 0, of the rest the median."""
        of_seeds = max(values) if dangerous else statistics.median(values)
        columns = {measure: f"{of_seeds:.6g}", measure + "_low": min(values), measure + "_high": max(values)}
        if dangerous:
            columns[measure + "_seeds"] = f"{sum(v > 0 for v in values)} of {len(values)}"
            if len(values) < 8 and self.size != "quick":
                sys.exit(f"report.py: {name}: {measure} is dangerous, and {len(values)} seeds are too few")
        return columns

    def seeds(self, name, data, *measures):
        of = {}
        for row in self.rows(data):
            of.setdefault((row["knob"], row["value"]), []).append(row)
        summary = []
        for rows in of.values():
            alike = {k: v for k, v in rows[0].items() if all(row[k] == v for row in rows) and k not in ("scene", "seed")}
            for m in measures:
                alike |= self.over_seeds(data, m.rstrip("!"), [float(row[m.rstrip("!")]) for row in rows], m.endswith("!"))
            summary.append(alike)
        columns = list(dict.fromkeys(k for row in summary for k in row))
        self.save(name, [{k: row.get(k, "") for k in columns} for row in summary])
        return ""

    def sweep(self, name, errors, counts):
        """A row for each setting of the sweep: the worst seed, how many, and the rate over all with its interval."""
        instructions = {(r["knob"], r["value"], r["section"]): r["instructions"] for r in self.rows(counts)}
        of = {}
        for row in self.rows(errors):
            of.setdefault((row["knob"], row["value"], row["section"]), []).append(row)
        table = []
        for key, rows in of.items():
            own, *besides = rows[0]["configuration"].split("; ")
            seeds = {c: [100 * float(r[c]) for r in rows] for c in rows[0] if c.endswith("_share")}
            low, high = interval(sum(int(r["past"]) for r in rows), sum(int(r["in_way"]) for r in rows))
            rate = sum(int(r["past"]) for r in rows) / sum(int(r["in_way"]) for r in rows)
            table.append({"key": own.split(" = ")[0], "value": key[1], "default": rows[0]["default"], "with": "; ".join(besides),
                          "configuration": rows[0]["configuration"], "past": f"{max(seeds['past_share']):.3g}",
                          "past_seeds": f"{sum(v > 0 for v in seeds['past_share'])} of {len(rows)}",
                          "past_rate": f"{100 * rate:.2g} ({100 * low:.2g} to {100 * high:.2g})",
                          "too_fast": f"{max(seeds['too_fast_share']):.3g}",
                          **{c: f"{statistics.median(seeds[c + '_share']):.3g}" for c in ("false_block", "unknown", "unsaid", "map_said")},
                          "map_false": f"{max(seeds['map_false_share']):.3g}",
                          "cost": f"{statistics.median(float(r['us_per_ping']) for r in rows):.3g}",
                          "instructions": instructions.get(key, "")})
        self.save(name, table)
        return ""

    def judge(self, name):
        points = [p for p in self.rows(name) if p["useful"] == "1"]
        measures = [k[6:] for k in points[0] if k.startswith("front_")]
        default = next((p for p in points if p["default"] == "1"), None)
        if not default:
            text = "**Finding: the shipped default is beyond a limit** that the settings below are held to."
            print(f"{name}: {text}", flush=True)
            return text
        # Medians of a few seeds, and the worst one, may hide in how many a setting is worse.
        winners = [p for p in points if better(p, default, ["cost", *measures]) and all(int(p[m + "_worse"]) <= 0 for m in measures)]
        names = [f"{p['knob']} = {p['value']}" for p in winners]
        self.better |= {(name, p["knob"], p["value"]) for p in winners}
        text = ("**Finding: the shipped default is dominated** by " + ", ".join(names) +
                ": no more cost, no measure worse, one better." if names else
                "No single knob, turned from its default, is better in one measure without costing more or being worse in "
                "another, in all seeds together or in most of them: the shipped default lies on the front.")
        thoughts = [f"{p['knob']} = {p['value']} ({m} {number(default[m])} to {number(p[m])})"
                    for p in points if p not in winners and float(p["cost"]) <= 1.05 * float(default["cost"]) and
                    all(float(p[m]) <= 1.1 * float(default[m]) for m in measures)
                    for m in measures if float(p[m]) < 0.5 * float(default[m])]
        if thoughts:
            text += "\n\n**Worth a thought**, since they at least halve one measure and make no other worse by more " \
                    "than a tenth: " + "; ".join(thoughts) + "."
        rows = []
        for m in measures:
            rivals = [p for p in points if float(p["cost"]) <= 1.01 * float(default["cost"])]
            best = min(rivals, key=lambda p, m=m: float(p[m]))
            if float(best[m]) >= float(default[m]):
                rows.append([m, number(default[m]), "the default", "", ""])
                continue
            loss = {k: (float(best[k]) - float(default[k])) / max(float(default[k]), 1e-3) for k in measures}
            worst = max(loss, key=loss.get)
            price = f"{worst} {number(default[worst])} to {number(best[worst])}" if loss[worst] > 0 else "none"
            rows.append([m, number(default[m]), f"{best['knob']} = {best['value']}", number(best[m]), price])
        header = ["measure", "default", "least at no more cost", "there", "its highest price"]
        print(f"{name}: {text}", flush=True)
        return text + "\n\n" + markdown_table(header, rows)

    # ---- conclusions ----

    def broke(self, what):
        """A conclusion that does not hold; with few repetitions many do not."""
        if self.size != "quick":
            self.broken.append(what)
            print(f"does not hold: {what}", flush=True)

    @unless_missing
    def claim(self, *words):
        expression, _, text = " ".join(words).partition(" :: ")
        text = self.claims.filled(text)
        if self.claims.holds(expression):
            return text
        self.broke(f"{text} ({expression})")
        return f"**Does not hold in this run:** {text}"

    def stays(self, name, *words):
        settings, _, claim = " ".join(words).partition(" :: ")
        for setting in settings.split():
            knob, _, value = setting.replace("~", " ").partition("=")
            self.explained.add((name, knob, value))
        return self.claim(claim)

    def unexplained(self):
        for name, knob, value in sorted(self.better - self.explained):
            self.broke(f"{name}: {knob} = {value} is better than the default in all that is measured, and nothing says why that stays")

    @unless_missing
    def say(self, *words):
        return self.claims.filled(" ".join(words))

    @unless_missing
    def stated(self, path, *words):
        text = self.claims.filled(" ".join(words).removeprefix(":: "))
        if " ".join(text.split()) not in " ".join(read(os.path.join(HERE, "..", path)).split()):
            self.broke(f"{path} does not state: {text}")
            return f"- **{path} states something else than:** {text}"
        return f"- {path}: {text}"

    # ---- text ----

    def plot(self, script):
        try:
            page.gnuplot(script, self.data, self.out, self.size == "quick")
        except subprocess.CalledProcessError:
            if self.size != "quick":
                raise
            return f"*{script} has too little to draw in a quick run.*"
        return ""

    def figure(self, name, *caption):
        drawn = os.path.join(self.out, name + ".svg")
        if self.size == "quick" and not (os.path.exists(drawn) and "<svg" in read(drawn)):
            return f"*Not drawn in a quick run: {' '.join(caption)}*"
        self.figures += 1
        return f"![Figure {self.figures}]({name}.svg)\n\n*Figure {self.figures}. {' '.join(caption)}*"

    def table(self, name, *words):
        where = dict(w.split("=", 1) for w in words if "=" in w)
        columns = [w.replace("~", " ").partition(":") for w in words if "=" not in w]
        rows = [r for r in self.rows(name) if all(r[k] == v.replace("~", " ") for k, v in where.items())]
        return markdown_table([title or key for key, _, title in columns],
                              [[number(r[key]) for key, _, _ in columns] for r in rows])

    def pivot(self, name, row, column, *words):
        where = dict(w.split("=", 1) for w in words if "=" in w)
        cells = [w for w in words if "=" not in w]
        data = [r for r in self.rows(name) if all(r[k] == v for k, v in where.items())]
        columns = list(dict.fromkeys(r[column] for r in data))
        table = {}
        for r in data:
            table.setdefault(r[row], {})[r[column]] = " / ".join(number(r[c]) for c in cells)
        return markdown_table([row, *columns], [[key, *(of.get(c, "") for c in columns)] for key, of in table.items()])

    def beside(self, name, left, right):
        self.save(name, [a | b for a, b in zip(self.rows(left), self.rows(right), strict=True)])
        return ""

    def stock(self, name):
        """What is said below the table, from the table: the report ends where an answer was false."""
        rows = self.rows(name)
        wrong = sum(int(row["false"]) for row in rows)
        if wrong:
            sys.exit(f"report.py: {name}: {wrong} answers were false")
        def alike(row):
            return row["place"], row["vehicle"].split(",")[0]

        ordered = all(float(a["said"]) >= float(b["said"])
                      for a, b in itertools.permutations(rows, 2)
                      if alike(a) == alike(b) and float(a["bound_mps"]) < float(b["bound_mps"]))
        text = "No answer was false. " + (
            "The more is allowed for, the less is said, of the same manoeuvre in the same place." if ordered else
            "**Finding: more is said of a manoeuvre in a place although more is allowed for.**")
        print(f"{name}: {text}", flush=True)
        return text

    def explain(self, scene):
        conf = os.path.join(HERE, "..", "config", "scenes", scene + ".conf")
        plan = json.loads(subprocess.run([os.path.join(self.build, "sonard"), "-c", conf, "--explain=json"],
                                         capture_output=True, text=True, check=True).stdout)
        return page.plan_table(plan)

    def machine(self):
        cpu = re.search(r"model name\s*: (.*)", read("/proc/cpuinfo"))
        cc = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
        kind = {"": "full", "quick": "QUICK=1: few repetitions, only to try the machinery",
                "long": "full, and with LONG=1 a billion updates of what runs for ever"}[self.size]
        return f"{platform.machine()}, {cpu[1] if cpu else 'unknown CPU'}, {os.cpu_count()} CPUs, {cc}; run: {kind}."

    def chapter(self, name):
        return self.expand(read(os.path.join(HERE, name + ".md")))

    def expand(self, text):
        return re.sub(r"^@(\w+) ?(.*)$", self.directive, text, flags=re.M)

    def directive(self, match):
        name, words = match[1], match[2].split()
        if name in MEASURED:
            return ""
        if name not in DIRECTIVES:
            sys.exit(f"report.py: @{name} is no directive")
        return getattr(self, name)(*words)

    def make(self):
        index = read(os.path.join(HERE, "index.md"))
        self.measure([read(os.path.join(HERE, name + ".md")) for name in re.findall(r"^@chapter (\w+)", index, re.M)])
        self.save("spent", [{"data": name, "cpu_s": f"{cpu_s:.2f}"} for name, cpu_s in sorted(self.cpu_s.items(), key=lambda s: -s[1])])
        text = re.sub(r"\n{3,}", "\n\n", self.expand(index))
        self.unexplained()
        page.make(self.out, text)
        print(f"report: {self.out}/index.html, {self.figures} figures, {time.monotonic() - self.begin:.0f} s, "
              f"{sum(self.cpu_s.values()):.0f} s of CPU")
        if self.broken:
            sys.exit("report.py: conclusions that do not hold over the data:\n" + "\n".join(self.broken))


MEASURED = ("run", "count", "count_long", "time")
DIRECTIVES = ("chapter", "peer", "if_peer", "points", "seeds", "sweep", "claim", "say", "stated", "judge", "stays", "plot", "figure", "table", "pivot", "beside", "stock", "explain", "machine")


def worse_seeds(rows, default, measure):
    """In how many more seeds a setting is worse than the default than it is better."""
    shipped = {row["seed"]: float(row[measure]) for row in default}
    differences = [float(row[measure]) - shipped[row["seed"]] for row in rows]
    return sum(d > 0 for d in differences) - sum(d < 0 for d in differences)


def better(q, p, keys):
    """q is in no key worse than p (1 % of cost is no difference), and in one better."""
    slack = {"cost": 1.01}
    return (all(float(q[k]) <= float(p[k]) * slack.get(k, 1.0) for k in keys) and
            any(float(q[k]) * slack.get(k, 1.0) < float(p[k]) for k in keys))


def tell(points, measure):
    """Which points have room for a name on logarithmic axes of cost and measure, beside the default: words before numbers, and
    those on the front before others."""
    def place(p):
        return math.log10(float(p["cost"])), math.log10(max(float(p[measure]), least))

    least = min((float(p[measure]) for p in points if float(p[measure]) > 0), default=1) / 2
    x, y = zip(*map(place, points))
    width, height = 0.12 * (max(x) - min(x)), 0.035 * (max(y) - min(y))
    taken = [place(p) for p in points if p["default"] == "1"][:1]
    for p in sorted(points, key=lambda p: (p["value"][0].isdigit(), -p["front_" + measure])):
        at = place(p)
        room = all(abs(at[0] - q[0]) > width or abs(at[1] - q[1]) > height for q in taken)
        p["told_" + measure] = int(room)
        taken += [at] if room else []


def main():
    arguments = argparse.ArgumentParser(description="make the report")
    arguments.add_argument("--build", default="build", help="folder of the measuring programs")
    arguments.add_argument("--out", default="build/report", help="folder that is made anew")
    size = arguments.add_mutually_exclusive_group()
    size.add_argument("--quick", dest="size", action="store_const", const="quick", default="", help="in seconds, with few repetitions")
    size.add_argument("--long", dest="size", action="store_const", const="long", help="a billion updates of what runs for ever")
    args = arguments.parse_args()
    try:
        Report(args.build, args.out, args.size).make()
    except subprocess.CalledProcessError as fault:
        sys.exit(f"report.py: {' '.join(fault.cmd)}: ended with status {fault.returncode}")


if __name__ == "__main__":
    main()
