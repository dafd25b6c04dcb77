#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""examples/archive: a folder of dives is replayed once each, what failed is tried again, tasks of an array share the list, and one page
shows all, the worst first."""
import csv
import os
import shutil

from lib import ALL, SONARD, check, run

HERE = os.path.abspath("examples/archive")


def dives(bench):
    """Three dives, of which one is no capture."""
    os.makedirs(bench.path("dives/a b"))
    for name in ("one.mcap", "a b/two.mcap"):
        shutil.copy("tests/replay/box.mcap", bench.path("dives/" + name))
    bench.write("dives/none.mcap", b"hello")
    return [bench.path("dives/" + name) for name in ("one.mcap", "a b/two.mcap", "none.mcap")]


def environment(**more):
    return ["env", "PATH=%s:%s" % (os.path.dirname(SONARD), os.environ["PATH"]), "SONARD_ARCHIVE=" + HERE, *("%s=%s" % pair for pair in more.items())]


def named(path):
    return path.lstrip("./")[:-len(".mcap")].replace("/", "_")


def each_dive_is_replayed_once(bench):
    paths, out = dives(bench), bench.path("out")
    for path, status in zip(paths, (0, 0, 1)):
        done = bench.run(*environment(), os.path.join(HERE, "dive.sh"), path, out)
        check(done.returncode == status, done.stderr)
    check(sorted(os.listdir(out)) == sorted(map(named, paths)), os.listdir(out))
    first = [os.stat(os.path.join(out, named(path), "took")).st_mtime_ns for path in paths]
    for path in paths:
        bench.run(*environment(), os.path.join(HERE, "dive.sh"), path, out)
    again = [os.stat(os.path.join(out, named(path), "took")).st_mtime_ns for path in paths]
    check([a == b for a, b in zip(first, again)] == [True, True, False], "what failed alone is tried again")
    done = bench.run("python3", os.path.join(HERE, "report.py"), out)
    check(done.returncode == 0 and "3 dives, 1 failed" in done.stdout, done.stdout + done.stderr)
    with open(os.path.join(out, "dives.csv"), encoding="utf-8") as f:
        rows = list(csv.DictReader(f))
    check([row["dive"] for row in rows][0] == named(paths[2]) and "not a capture" in rows[0]["ended"], rows)
    check(all(float(r["blocked"]) > 0 and float(r["nearest_m"]) > 0 and r["ended"] == "well" and r["without_a_pose"] == "1" for r in rows[1:]), rows)
    with open(os.path.join(out, "index.html"), encoding="utf-8") as f:
        text = f.read()
    check("<h1>3 dives" in text and "%s/log" % named(paths[2]) in text, text[:500])


def tasks_share_the_list(bench):
    """Two tasks of an array, of which each has a part; submitted again, they do nothing."""
    paths, out = dives(bench)[:2], bench.path("out")
    listed = bench.write("dives.txt", "\n".join(paths + [""]))
    for task, want in ((4, 1), (5, 2)):
        array = {"SLURM_ARRAY_TASK_ID": task, "SLURM_ARRAY_TASK_MIN": 4, "SLURM_ARRAY_TASK_COUNT": 2}
        done = bench.run(*environment(**array), "sh", os.path.join(HERE, "dives.slurm"), listed, out)
        check(done.returncode == 0 and len(os.listdir(out)) == want, done.stderr)
    check(sorted(os.listdir(out)) == sorted(map(named, paths)), os.listdir(out))


def mistakes_are_named(bench):
    """Without its arguments, without sonard, with a folder that is not there: each says what to do."""
    script = os.path.join(HERE, "dive.sh")
    for arguments, path, want in (((), None, "usage: dive.sh CAPTURE OUT"), (("none.mcap", "out"), None, "none.mcap: no such capture"),
                                  (("tests/replay/box.mcap", "out"), "/usr/bin:/bin", "sonard is not in PATH")):
        done = bench.run("env", "PATH=" + (path or os.environ["PATH"]), "sh", script, *arguments)
        check(done.returncode == 2 and want in done.stderr and not os.path.exists("out"), "%s: %s" % (arguments, done.stderr))
    done = bench.run("python3", os.path.join(HERE, "report.py"), bench.path("nowhere"))
    check(done.returncode == 1 and "no such folder; dive.sh makes it" in done.stderr and "Traceback" not in done.stderr, done.stderr)


run([(case.__name__, case) for case in (each_dive_is_replayed_once, tasks_share_the_list, mistakes_are_named)], gate=ALL)
