#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Several grids of one running daemon: from the configuration, made and dropped at run time, each asked by name."""
import json
import threading

from lib import Client, RpcError, check, pings_until, run, until
from twin import Twin


def basin(bench, threads, **sections):
    """From 6 m behind to 9 m ahead and from 5 m left to 4 m right; the sonar sweeps the half ahead."""
    Twin(bench, "echolist_sim", "--from", "-90", "--to", "90")
    bench.conf(sonar={"device": "echolist", "range": "20 m", "step": "3 deg", "mode": "auto"},
               pipeline={"threads": threads}, **sections)
    return bench.sonard().client()


def grids(client):
    return {grid["name"]: grid for grid in client.call("grid_list")["grids"]}


def ahead(client, **params):
    return client.call("sectors", count=24, **params)["sectors"][0]


def refused(client, method, **params):
    try:
        client.call(method, **params)
    except RpcError as e:
        return str(e)
    check(False, "%s %s was taken" % (method, params))
    return ""


def case_of_the_configuration(bench):
    client = basin(bench, 2, **{"grid near": {"range": "5 m", "angular_step": "4 deg"}, "grid": {"layer": "0.1 m"}})
    pings_until(client, 130)
    known = grids(client)
    check(list(known) == ["main", "near"], str(known))
    check(known["near"]["range_m"] == 5 and known["near"]["angular_step_deg"] == 4, str(known["near"]))
    check(known["near"]["layer_m"] == 0.1, "what [grid near] does not say is as in [grid]: %s" % known["near"])
    check(ahead(client)["state"] == "blocked" and ahead(client, grid="main")["state"] == "blocked", "the main grid")
    far = ahead(client, grid="near")
    check(far["state"] != "blocked" and far["free_to_m"] < 9, "9 m is beyond the near grid: %s" % far)
    right = client.call("blocked", azimuth_deg=90, distance_m=4.5, grid="near")
    check(right["state"] == "blocked" and abs(right["range_m"] - 4) < 0.3, str(right))
    check(client.call("clusters", grid="near")["all"] >= 1, "clusters of the near grid")
    check(client.call("next_look", grid="near", count=1)["directions"], "next_look in the near grid")
    check(known["near"]["out_of_range"] > 0, str(known))
    check([g["name"] for g in client.call("status")["grids"]] == ["main", "near"], "status")


def case_made_and_dropped(bench):
    client = basin(bench, 2)
    pings_until(client, 70)
    made = client.call("grid_create", name="coarse", settings={"angular_step": "10 deg", "range": "30 m"})
    check(made["cells"] == 0 and made["range_m"] == 30 and made["angular_step_deg"] == 10, str(made))
    pings_until(client, 130)
    check(ahead(client, grid="coarse")["state"] == "blocked", "it learns")
    client.call("grid_drop", name="coarse")
    check("none of that name" in refused(client, "sectors", grid="coarse"), "a dropped grid")


def case_refused(bench):
    client = basin(bench, 1, grids={"memory": "20 MiB"})
    for params, why in (({"name": "a b"}, "no name"), ({"name": "main"}, "there is one"), ({}, "wanted the name"),
                        ({"name": "x", "settings": {"range": "5 km"}}, "want 0.75 to 200 m"),
                        ({"name": "x", "settings": {"rnge": "5 m"}}, "did you mean range"),
                        ({"name": "x", "settings": {"range": 5}}, "wanted a text"),
                        ({"name": "x", "settings": {"forget": "1 s"}}, "forget not shorter"),
                        ({"name": "x", "settings": {"max_cells": "1000000"}}, "at most 20 MiB")):
        message = refused(client, "grid_create", **params)
        check(why in message, "%s: %s" % (params, message))
    check("main grid stays" in refused(client, "grid_drop", name="main"), "main")
    check("no grid" in refused(client, "grid_drop", name="x"), "one that is not")
    check(list(grids(client)) == ["main"], str(grids(client)))


def case_clusters_count(bench):
    """What clusters take is in the sum, and refused beyond the limit."""
    client = basin(bench, 1, grids={"memory": "20 MiB"}, grid={"max_cells": "100000"})
    check("at most 20 MiB" in refused(client, "clusters"), "clusters beyond the memory of grids")
    client.call("grid_create", name="small", settings={"max_cells": "1024", "elevation": "level"})
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


def case_at_most_five(bench):
    client = basin(bench, 2)
    for i in range(4):
        client.call("grid_create", name="g%d" % i, settings={"max_cells": "1024", "elevation": "level"})
    check("no more" in refused(client, "grid_create", name="g4"), "a sixth grid")
    client.call("grid_drop", name="g1")
    client.call("grid_create", name="g4")
    check(list(grids(client)) == ["main", "g0", "g2", "g3", "g4"], str(list(grids(client))))


def case_others_ask_meanwhile(bench):
    """One client makes and drops, another asks: an answer or a refusal, never anything else."""
    client = basin(bench, 2)
    stop, odd = threading.Event(), []

    def ask():
        other = Client(bench.socket_path)
        while not stop.is_set():
            try:
                if len(other.call("sectors", grid="now")["sectors"]) != 72:
                    odd.append("sectors")
                other.call("clusters", grid="now")
            except RpcError as e:
                if "none of that name" not in str(e) and "it was dropped meanwhile" not in str(e):
                    odd.append(str(e))
        other.close()

    thread = threading.Thread(target=ask)
    thread.start()
    try:
        for _ in range(40):
            client.call("grid_create", name="now", settings={"elevation": "level", "max_cells": "2048"})
            client.call("grid_drop", name="now")
    finally:
        stop.set()
        thread.join()
    check(not odd, str(odd[:3]))


def case_large_ones_are_made_in_parts(bench):
    """Two clients make large grids at once, a third goes away in the middle: nothing is left of its grid."""
    client = basin(bench, 2, grids={"memory": "512 MiB"})
    settings = {"elevation": "level", "max_cells": "1000000"}
    before = client.call("grid_list")["bytes"]
    leaver = Client(bench.socket_path)
    leaver.send(json.dumps({"jsonrpc": "2.0", "id": 1, "method": "grid_create",
                            "params": {"name": "left", "settings": settings}}).encode() + b"\n")
    leaver.close()
    others = [Client(bench.socket_path) for _ in range(3)]
    made = [[], [], []]

    def make(i, name):
        try:
            made[i].append(others[i].call("grid_create", name=name, settings=settings)["name"])
        except RpcError as e:
            made[i].append(str(e))

    threads = [threading.Thread(target=make, args=(i, name)) for i, name in enumerate(("a", "b", "b"))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    said = [m[0] for m in made]
    check(said[0] == "a" and sorted(len(s) > 1 for s in said[1:]) == [False, True], str(said))
    check(any("there is one" in s for s in said[1:]), str(said))

    def nothing_left():
        for name in list(grids(client))[1:]:
            client.call("grid_drop", name=name)
        return client.call("grid_list")["bytes"] == before
    until(nothing_left, "the memory of grids that are no more to be free")


def case_sonarctl(bench):
    client = basin(bench, 0)
    made = bench.sonarctl("grid", "create", "far", "range=100 m", "growth=1.1").stdout.splitlines()
    lines = bench.sonarctl("grid", "list").stdout.splitlines()
    check(made[0] == lines[0] and made[1].split()[0] == lines[2].split()[0] == "far", "create says %s, list %s" % (made, lines))
    check(len(lines) == 4 and lines[1].startswith("main") and "100" in lines[2], str(lines))
    check(bench.sonarctl("sectors", "--grid", "far").stdout, "sectors --grid")
    check(bench.sonarctl("grid", "drop", "far").stdout == "dropped\n", "drop")
    check(list(grids(client)) == ["main"], "dropped")


def case_axes_follow_the_course(bench):
    """Beside a main grid in NED one that follows the heading: asked the same, they answer the same."""
    client = basin(bench, 2, pose={"max_age": "60 s"},
                   **{"grid ahead": {"axes": "course"}, "grid": {"angular_step": "3 deg", "max_cells": "16384"}})
    check({name: g["axes"] for name, g in grids(client).items()} == {"main": "ned", "ahead": "course"}, str(grids(client)))
    made = client.call("grid_create", name="made", settings={"axes": "course"})
    check(made["axes"] == "course", str(made))
    check("want ned or course" in refused(client, "grid_create", name="x", settings={"axes": "north"}), "axes = north")
    yaw_deg, done = 0, threading.Event()

    def tell():
        teller = Client(bench.socket_path)
        while not done.wait(0.05):
            teller.call("pose", attitude_deg=[0, 0, yaw_deg], position_m=[0, 0, 5])
        teller.close()
    thread = threading.Thread(target=tell)
    thread.start()
    try:
        for yaw_deg in (0, 30, 77):
            pings_until(client, 200)
            for frame, azimuth_deg in (("body", 0), ("ned", yaw_deg)):
                main, course = (client.call("blocked", azimuth_deg=azimuth_deg, distance_m=12, frame=frame, grid=name)
                                for name in ("main", "ahead"))
                check(main["state"] == course["state"] == "blocked", "at %g: %s, %s" % (yaw_deg, main, course))
                check(abs(main["range_m"] - course["range_m"]) < 0.5, "at %g: %s, %s" % (yaw_deg, main, course))
            told = client.call("explain", azimuth_deg=yaw_deg, distance_m=12, frame="ned", grid="ahead")["cells"]["nearest"]
            check(told and all(abs((c["azimuth_deg"] - yaw_deg + 180) % 360 - 180) < 15 for c in told), str(told))
    finally:
        done.set()
        thread.join()


run([("grids_" + name[5:], function) for name, function in list(globals().items()) if name.startswith("case_")],
    parallel=2)
