#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Several grids of one daemon, each asked by name, and every cell of one."""
from voyage import Voyage

from lib import check, refused, run


def basin(bench, threads, **sections):
    """From 6 m behind to 9 m ahead and from 5 m left to 4 m right; the sonar sweeps the half ahead."""
    bench.conf(sonar={"device": "echolist", "range": "20 m"},
               pipeline={"threads": threads}, **sections)
    return Voyage(bench, "echolist_sim", "--from", "-90", "--to", "90")


def apart(a_deg, b_deg):
    return abs((a_deg - b_deg + 180) % 360 - 180)


def grids(client):
    return {grid["name"]: grid for grid in client.call("grid_list")["grids"]}


def ahead(client, **params):
    return client.call("sectors", count=24, distance_m=0, **params)["sectors"][0]


def case_of_the_configuration(bench):
    trip = basin(bench, 2, **{"grid near": {"range": "5 m", "angular_step": "4 deg"}, "grid": {"layer": "0.1 m"}})
    trip.pings(130)
    client = trip.client()
    known = grids(client)
    check(list(known) == ["main", "near"], str(known))
    check(known["near"]["range_m"] == 5 and known["near"]["angular_step_deg"] == 4, str(known["near"]))
    check(known["near"]["layer_m"] == 0.1, "what [grid near] does not say is as in [grid]: %s" % known["near"])
    check(ahead(client)["state"] == "blocked" and ahead(client, grid="main")["state"] == "blocked", "the main grid")
    far = ahead(client, grid="near")
    check(far["state"] != "blocked" and far["free_to_m"] < 9, "9 m is beyond the near grid: %s" % far)
    right = client.call("blocked", azimuth_deg=90, distance_m=4.5, grid="near")
    check(right["state"] == "blocked" and abs(right["range_m"] - 4) < 0.2, str(right))
    check(client.call("clusters", grid="near")["all"] >= 1, "clusters of the near grid")
    check(client.call("next_look", grid="near", count=1)["directions"], "next_look in the near grid")
    check(known["near"]["out_of_range"] > 0, str(known))
    check([g["name"] for g in client.call("status")["grids"]] == ["main", "near"], "status")


def cells_of(client, **params):
    """All pages, and whether the grid moved."""
    cells, cursor, changed, pages = [], None, False, 0
    while True:
        page = client.call("grid_cells", cursor=cursor, **params)
        cells, changed, pages = cells + page["cells"], changed or page["changed"], pages + 1
        cursor = page["cursor"]
        check(len(page["cells"]) <= params.get("count", 256), "too many cells: %d" % len(page["cells"]))
        if cursor is None:
            return cells, changed, pages


def case_every_cell(bench):
    """The pages hold each cell of the grid once, whatever their size, and so do the files."""
    trip = basin(bench, 1, grid={"sensor_model": "gauss"})
    trip.pings(200)
    client = trip.client()
    known = grids(client)["main"]["cells"]
    cells, changed, pages = cells_of(client, count=7)
    check(not changed and pages > 3, "%d pages, changed: %s" % (pages, changed))
    keys = [(c["azimuth_deg"], c["elevation_deg"], c["from_m"]) for c in cells]
    check(len(keys) == len(set(keys)), "a cell came twice")
    check(len(cells) == known, "%d cells of %d" % (len(cells), known))
    check(any(c["blocks"] for c in cells) and all(c["from_m"] < c["to_m"] for c in cells), str(cells[:3]))
    walls = [c for c in cells if c["blocks"] and apart(c["azimuth_deg"], 90) < 6]
    nearest = min(walls, key=lambda c: c["near_m"])["position_m"]
    check(abs(nearest[1] - 4) < 0.4 and abs(nearest[0]) < 0.6, "the wall at 4 m to starboard: %s" % nearest)
    for cursor in ("1", "1.2.3", "1.2.3.1x", "-1.2.3.0", "1.2.3.0.5"):
        check("cursor" in refused(client, "grid_cells", cursor=cursor), "cursor %s" % cursor)
    check(client.call("grid_cells", cursor="999999999.0.0.0")["cursor"] is None, "beyond the last direction")
    csv, mcap = bench.path("cells.csv"), bench.path("cells.mcap")
    told = bench.sonarctl("grid", "export", csv)
    check(told.returncode == 0 and "cells written" in told.stdout, told.stdout + told.stderr)
    with open(csv, encoding="utf-8") as f:
        head, *rows = [line.rstrip("\n").split(",") for line in f]
    check(head[:4] == ["t_unix", "forward_m", "right_m", "down_m"], str(head))
    check(rows and all(len(row) == len(head) and all(row) for row in rows), str(rows[:2]))
    starboard = [dict(zip(head, row)) for row in rows]
    starboard = [c for c in starboard if c["blocks"] == "1" and apart(float(c["azimuth_deg"]), 90) < 6]
    check(abs(float(min(starboard, key=lambda c: float(c["near_m"]))["right_m"]) - 4) < 0.4, str(starboard[:2]))
    told = bench.sonarctl("grid", "export", mcap)
    check(told.returncode == 0 and int(told.stdout.split()[0]) == len(rows), told.stdout + told.stderr)
    info = bench.sonarctl("capture", "info", mcap)
    check(info.returncode == 0 and "/grid/cells" in info.stdout, info.stdout + info.stderr)
    check(bench.sonarctl("grid", "export", "-").stdout.startswith("t_unix,"), "CSV on standard output")
    check(bench.sonarctl("grid", "export", bench.path("cells.txt")).returncode == 3, "another ending")
    check(bench.sonarctl("grid", "export", bench.path("no/cells.csv")).returncode == 7, "no such folder")
    check(bench.sonarctl("grid", "export", csv, "--grid", "none").returncode == 6, "no such grid")


def case_axes_follow_the_course(bench):
    """Beside a main grid in NED one that follows the heading: asked the same, they answer the same."""
    trip = basin(bench, 2, pose={"max_age": "60 s"},
                 **{"grid ahead": {"axes": "course"}, "grid": {"angular_step": "3 deg", "max_cells": "16384"}})
    stops = []
    for yaw_deg in (0, 30, 77):
        for _ in range(100):
            trip.place(0, 0, 0, yaw_deg)
            trip.run(0.1)
        stops.append((yaw_deg, trip.now_s - 0.01))  # before it turns on
    at = trip.moments()
    check({name: g["axes"] for name, g in grids(at(0)).items()} == {"main": "ned", "ahead": "course"}, str(grids(at(0))))
    for yaw_deg, stop_s in stops:
        client = at(stop_s)
        for frame, azimuth_deg in (("body", -yaw_deg), ("ned", 0)):
            main, course = (client.call("blocked", azimuth_deg=azimuth_deg, distance_m=12, frame=frame, grid=name)
                            for name in ("main", "ahead"))
            check(main["state"] == course["state"] == "blocked", "at %g: %s, %s" % (yaw_deg, main, course))
            check(abs(main["range_m"] - 9) < 0.4 and abs(course["range_m"] - 9) < 0.4, "at %g: %s, %s" % (yaw_deg, main, course))
        told = client.call("explain", azimuth_deg=0, distance_m=12, frame="ned", grid="ahead")["cells"]["nearest"]
        check(told and all(apart(c["azimuth_deg"], 0) < 15 for c in told), str(told))


run([("grids_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")])
