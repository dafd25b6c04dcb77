#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Several grids of one running daemon: their memory, and what is refused. tests/voyage/test_grids.py asks them."""
import subprocess

from lib import check, note, pings_until, refused, run
from twin import Twin


def basin(bench, threads, **sections):
    """From 6 m behind to 9 m ahead and from 5 m left to 4 m right; the sonar sweeps the half ahead."""
    Twin(bench, "echolist_sim", "--from", "-90", "--to", "90")
    bench.conf(sonar={"device": "echolist", "range": "20 m"},
               pipeline={"threads": threads}, **sections)
    return bench.sonard().client()


def case_clusters_count(bench):
    """What clusters take is in the sum, and refused beyond the limit."""
    client = basin(bench, 1, grids={"memory": "20 MiB"}, grid={"max_cells": "100000"},
                   **{"grid small": {"max_cells": "1024", "elevation": "level"}})
    check("at most 20 MiB" in refused(client, "clusters"), "clusters beyond the memory of grids")
    before = client.call("grid_list")["bytes"]
    client.call("clusters", grid="small")
    check(client.call("grid_list")["bytes"] > before + 1024 * 64, "clusters are not counted")


def case_as_planned(bench):
    """The plan and the list of grids tell the same memory, before and after somebody asks for clusters."""
    client = basin(bench, 0)
    planned = {stage["name"]: stage["bytes"] for stage in client.call("plan")["stages"]}

    def agree(*stages):
        took, told = client.call("grid_list")["bytes"], sum(planned[stage] for stage in stages)
        check(abs(took - told) <= 64 * len(stages), "%d bytes are taken, %d were planned" % (took, told))
    agree("grid", "elevation")
    client.call("clusters")
    agree("grid", "elevation", "clusters")


def case_refused(bench):
    client = basin(bench, 1)
    check("no grid of that name" in refused(client, "sectors", grid="far"), "a grid that is not there")
    check("expected a string" in refused(client, "sectors", grid=7), "a number for a name")


def case_too_much_memory(bench):
    bench.conf(grids={"memory": "20 MiB"}, **{"grid far": {"max_cells": "1000000"}})
    daemon = bench.sonard()
    daemon.expected = 3
    check(daemon.wait() == 3 and "with grid far all grids together" in daemon.log() and "at most 20 MiB" in daemon.log(),
          daemon.log())


def case_sonarctl(bench):
    basin(bench, 0, **{"grid far": {"range": "100 m", "growth": "1.1"}})
    lines = bench.sonarctl("grid", "list").stdout.splitlines()
    check(len(lines) == 4 and lines[1].startswith("main") and lines[2].startswith("far") and "100" in lines[2], str(lines))
    check(bench.sonarctl("sectors", "--grid", "far").stdout, "sectors --grid")


def case_export_is_read_by_others(bench):
    """The capture of all cells, by the reader from npm where there is one; tests/voyage/test_grids.py has what is in it."""
    client = basin(bench, 1, grid={"sensor_model": "gauss"})
    pings_until(client, 200)
    mcap = bench.path("cells.mcap")
    told = bench.sonarctl("grid", "export", mcap)
    check(told.returncode == 0, told.stderr)
    read = subprocess.run(["tests/mcap/check.sh", mcap], text=True, capture_output=True, check=False, timeout=300)
    check(read.returncode == 0 and ("%d points" % int(told.stdout.split()[0]) in read.stdout or read.stdout.startswith("skip")),
          read.stdout + read.stderr)
    note(read.stdout.strip())


run([("grids_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")],
    parallel=2,
    gate=("grids_refused", "grids_clusters_count", "grids_as_planned", "grids_too_much_memory", "grids_sonarctl"))
