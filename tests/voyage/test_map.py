#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The voxel map: a virtual basin against its truth, files, exports, threads."""
import hashlib
import json
import math
import os
import random
import struct

from voyage import ping360

from lib import BUILD, check, expect_refusal, note, run, until
from map_truth import VOXEL, check_points, clearance, done, job, state_of

TURN = 200                           # pings of a full circle at 1.8 degrees
STEP_S = 0.05                        # from pose to pose
STEP_M = 0.05                        # of a vehicle under way


def conf(bench, vehicle=None, **keys):
    section = {"voxel": "%g m" % VOXEL, "opening": 1, "memory": "48 MiB", "directory": bench.folder}
    section.update(keys)
    bench.conf(map=section, vehicle=vehicle or {})


def stay(trip, at, seconds):
    for _ in range(round(seconds / STEP_S)):
        trip.place(*at)
        trip.run(STEP_S)


def dive(bench, vehicle=None):
    """Two places, two turns at each: the voyage, and the moment at which the vehicle leaves the first one."""
    conf(bench, vehicle)
    trip = ping360(bench)
    at = [0.0, 0.0, 2.0]
    stay(trip, at, 10)
    moved_s = trip.now_s
    for _ in range(40):
        at = [at[0] + STEP_M, at[1] - STEP_M / 2, at[2]]
        stay(trip, at, STEP_S)
    stay(trip, at, 10)
    return trip, moved_s


def asked(trip, moved_s, *arguments):
    """A client at the end of the dive, with a submap for each of the two places."""
    at = trip.moments(*arguments)
    at(moved_s).call("map_new")
    client = at(trip.now_s)
    check(client.call("map")["begun"] == 2, "no second submap")
    return client


def check_paths(client, dice):
    free = 0
    for _ in range(400):
        way = [[dice.uniform(-6, 9), dice.uniform(-5, 4), 2.0] for _ in range(dice.randint(1, 4))]
        radius = dice.uniform(0, 0.8)
        answer = client.call("path", points_m=way, radius_m=radius)
        least = min(clearance(p) for p in way)
        if answer["state"] == "free":
            free += 1
            check(answer["first"] is None and least > radius - VOXEL / 2, "%s %g: %s" % (way, radius, answer))
        else:
            check(answer["first"]["along_m"] >= 0 and 0 <= answer["unknown_share"] <= 1, str(answer))
            farther = answer["state"] == "occupied" and answer["first"]["state"] == "unknown"
            check(("farther on" in answer["reason"]) == farther, "the reason is of another place: %s" % answer)
        wider = client.call("path", points_m=way, radius_m=radius + 0.3)
        check(not (wider["state"] == "free" and answer["state"] != "free"), "wider is freer: %s" % way)
    check(free >= 5, "only %d paths are free" % free)
    return free


def basin(bench):
    """Answers about places against what is there, the same with any number of threads."""
    trip, moved_s = dive(bench)
    told = []
    for threads in ("0", "1", "2"):
        client = asked(trip, moved_s, "--threads", threads, "--measure")
        told.append(check_basin(bench, client))
        client.close()
        bench.processes[-1].stop()
    check(told[0] == told[1] == told[2], "threads change the answers")


def check_basin(bench, client):
    dice = random.Random(7)
    free = check_points(client, dice)
    paths = check_paths(client, dice)
    status = client.call("map")
    check(status["state"] == "kept" and status["pings"] > 4 * TURN and status["starved"] == 0, str(status))
    note("%d of 1500 points and %d of 400 paths free, none behind a wall" % (free, paths))
    wall = client.call("path", points_m=[[3, 1, 2], [14, 1, 2]], radius_m=0.2)
    check(wall["state"] == "occupied" and 4.5 < wall["first"]["along_m"] < 6, "to the wall: %s" % wall)
    check(state_of(client, "box", from_m=[3, 0, 1.8], to_m=[5, 1, 2.2]) == "free", "a box in the water")
    check(state_of(client, "box", from_m=[3, 0, 1.8], to_m=[12, 1, 2.2]) == "occupied", "a box through a wall")

    check_large(client)
    check_examples(client)
    drawn = bench.sonarctl("map", "draw", "--depth", "2", "--middle", "1.5,-0.5", "--size", "20")
    check(drawn.returncode == 0 and drawn.stdout.count(".") > 500 and "#" in drawn.stdout, drawn.stdout + drawn.stderr)
    svg = bench.sonarctl("map", "draw", "--depth", "2", "--middle", "1.5,-0.5", "--size", "20", "-o", "-")
    check(svg.stdout.rstrip().endswith("</svg>") and svg.stdout.count("<rect") > 50, svg.stderr)
    for words, wanted in ((("point", "1,0.5,2"), 0), (("point", "30,0,2"), 2),
                          (("path", "3,1,2", "6,1,2", "--radius", "0.2"), 0),
                          (("path", "3,1,2", "30,1,2", "--radius", "0.2"), 1),
                          (("box", "3,0,2", "4,1,2"), 0), (("point", "1,2"), 3)):
        result = bench.sonarctl(*words)
        check(result.returncode == wanted, "%s: %d, %s" % (words, result.returncode, result.stdout + result.stderr))
    return free, paths, slices(client)


def jumps(bench):
    """A pose that the vehicle cannot have come to holds the map, until it jumps back or somebody says what is true."""
    trip, moved_s = dive(bench, vehicle={"max_speed": "1 m/s"})
    moments = []
    for what in (2, 90, 91, 2.5, {"depth_m": 12}, {"depth_m": 2}, -400, -401, 50, 51):
        trip.pose(**(what if isinstance(what, dict) else {"position_m": [what, 0, 2], "attitude_deg": [0, 0, 0]}))
        trip.run(0.01)
        moments.append(trip.now_s - 0.005)
    at = trip.moments()
    at(moved_s).call("map_new")

    def held(client):
        answer = client.call("box", from_m=[3, 0, 1.8], to_m=[4, 1, 2.2])
        status = client.call("map")["state"]
        check((answer["state"] != "free") == status.startswith("held"), "%s, %s" % (answer, status))
        check(answer["state"] == "free" or "jumped" in answer["reason"], str(answer))
        return answer["state"] != "free"
    for moment_s, wanted, what in zip(moments, (False, True, True, False, True, False, True), (
            "where the vehicle is", "after a jump", "two positions of another origin are no way", "the position is back",
            "a depth of another datum is no dive", "the depth is back", "another jump")):
        check(held(at(moment_s)) == wanted, "%s: held is %s" % (what, not wanted))
    client = at(moments[6])
    check(client.call("map_new") and not held(client), "held, and the client says that it is the same place")
    check(not held(at(moments[7])), "held, where the client said that it is")
    client = at(moments[8])
    check(held(client) and client.call("map_forget")["state"] != "held", "a second jump")
    check("held" not in at(moments[9]).call("map")["state"], "held, and nothing is in it")
    check("the pose jumped by" in bench.processes[-1].log(), bench.processes[-1].log())


def farther_than_it_goes(bench):
    """14 m within 1.2 s are a jump of a vehicle that goes 1 m/s, and none of one of which nobody says how fast it is."""
    for vehicle, found in (({}, False), ({"max_speed": "1 m/s"}, True)):
        conf(bench, vehicle)
        trip = ping360(bench)
        stay(trip, [2, 0, 2], 1)
        trip.run(1.2)
        trip.pose(position_m=[16, 0, 2], attitude_deg=[0, 0, 0])
        client = trip.client()
        check(client.call("map")["state"].startswith("held") == found, "a vehicle of %s: %s" % (vehicle, client.call("map")))
        client.close()
        bench.processes[-1].stop()


def requests_and_parts(client):
    stage = {"stage": "request"}
    return next(s["count"] for m in client.call("stats")["metrics"] for s in m["samples"] if s.get("labels") == stage)


def check_large(client):
    """A question about two million voxels is answered in parts, between which pings and others have their turn."""
    before = requests_and_parts(client)
    box = dict(from_m=[-12, -12, -10], to_m=[12.4, 12.4, 14.4])
    check(state_of(client, "box", **box) == "occupied", "a large box with walls in it")
    parts = requests_and_parts(client) - before
    check(parts > 100, "a question about 1.8 million voxels was answered in %d parts" % parts)
    watch = client.call("watch", method="box", params=box, rate_hz=20)["watch"]
    until(lambda: client.call("version") and client.notifications, "a large box that is watched")
    check(client.notifications[0]["result"]["state"] == "occupied", str(client.notifications[0]))
    client.call("unwatch", watch=watch)


def check_examples(client):
    """What the manual page shows is answered as it says."""
    with open(os.path.join(BUILD, "sonard-protocol.7"), encoding="utf-8") as f:
        lines = [line for line in f if line.startswith('{"jsonrpc"') and ('"position_m"' in line or '"from_m"' in line
                 or '"points_m"' in line or '"map_' in line)]
    check(len(lines) == 5, "%d examples" % len(lines))
    for line in lines:
        client.send(line.encode())
        reply = client.reply()
        check("result" in reply and reply["id"] == json.loads(line)["id"], "%s: %s" % (line, reply))
        if "state" in reply["result"] and "reason" in reply["result"]:
            check(reply["result"]["state"] == "free", "%s: %s" % (line, reply))


def slices(client):
    return [client.call("map_slice", depth_m=depth, middle_m=[1.5, -0.5], size_m=24)["rows"] for depth in (1, 2, 3)]


def files(bench):
    """Saved, cleared, loaded, also by another daemon: the same answers."""
    conf(bench)
    client = asked(*dive(bench))
    before = slices(client)
    saved = bench.sonarctl("map", "save", "basin")
    check(saved.returncode == 0 and "saved as" in saved.stdout, saved.stdout + saved.stderr)
    path = bench.path("basin.map")
    check(os.path.exists(path) and not os.path.exists(path + ".new"), "not saved")
    client.call("map_forget")
    check(state_of(client, "point", position_m=[1, 0, 2]) == "unknown", "cleared, and not unknown")
    check(not any("." in row for rows in slices(client) for row in rows), "something is left")
    done(client, "map_load", name="basin")
    check(slices(client) == before, "what was loaded is not what was saved")
    bench.processes[-1].stop()
    client = bench.sonard().client()
    loaded = bench.sonarctl("map", "load", "basin")
    check(loaded.returncode == 0 and "another run" in loaded.stdout, loaded.stdout + loaded.stderr)
    check(slices(client) == before, "another daemon has another map")
    check_load_at_start(bench, before)
    client = bench.sonard().client()
    done(client, "map_load", name="basin")
    check_foreign(bench, client, path, before)


def check_load_at_start(bench, before):
    """load in [map]: a named map is there from the start; one that is not is told, and the run begins empty."""
    for name, loaded in (("basin", True), ("nowhere", False)):
        bench.processes[-1].stop()
        conf(bench, load=name)
        daemon = bench.sonard()
        client = daemon.client()
        kept = client.call("map")["kept"]
        check((slices(client) == before) == loaded, "load = %s: %s" % (name, kept))
        check((kept["what"], kept["state"]) == ("load", "done" if loaded else "failed"), str(kept))
        check(loaded or "no such map; there are: basin" in daemon.log(), daemon.log())
        client.close()
    bench.processes[-1].stop()
    conf(bench)


def check_foreign(bench, client, path, before):
    """Files that are none, or none of ours, or damaged: refused, and the map stays as it is."""
    with open(path, "rb") as f:
        good = f.read()

    def refused(name, content, why, aside):
        bench.write(name + ".map", content)
        result = job(client, "map_load", name=name)
        check(result["state"] == "failed" and why in result["message"], "%s: %s" % (name, result))
        check(os.path.exists(bench.path(name + ".map.damaged")) == aside, "%s: set aside or not" % name)
        check(slices(client) == before, name + " has changed the map")

    flipped = bytearray(good)
    flipped[len(good) // 2] ^= 4
    refused("flipped", bytes(flipped), "damaged", True)
    refused("short", good[:-1000], "damaged", True)
    refused("empty", b"", "not a map", False)
    refused("other", b"ply\nformat ascii 1.0\n", "not a map", False)
    refused("newer", good[:8] + struct.pack("<I", 4) + good[12:], "version 4", False)
    missing = bench.sonarctl("map", "load", "nowhere")
    check(missing.returncode == 6 and "no such map" in missing.stderr, missing.stderr)
    bench.write("mine.map", "my own notes")
    result = job(client, "map_save", name="mine")
    check(result["state"] == "failed" and "not replaced" in result["message"], str(result))
    conf(bench, voxel="0.25 m")
    client.close()
    bench.processes[-1].stop()
    client = bench.sonard().client()
    result = job(client, "map_load", name="basin")
    check(result["state"] == "failed" and "0.25" in result["message"] and os.path.exists(path), str(result))


def veil(bench):
    """What was heard beyond a submap's box is known of in a saved map, too."""
    conf(bench, height="2 m")
    trip = ping360(bench)
    stay(trip, [0, 0, 2], 10)
    client = trip.client()

    def heard():
        return "was forgotten" in client.call("point", position_m=[-6, 0, 3.6])["reason"]
    check(heard(), "the wall below the box: %s" % client.call("point", position_m=[-6, 0, 3.6]))
    done(client, "map_save", name="veiled")
    client.call("map_forget")
    check(not heard(), "it is not forgotten")
    done(client, "map_load", name="veiled")
    check(heard(), "not saved")


def surface_of(client, **params):
    """All pages of one reading: points by place, and whether the map changed meanwhile."""
    points, cursor, changed, pages = {}, None, False, 0
    while cursor is not None or not pages:
        page = client.call("surface", cursor=cursor, **params)
        for p in page["points"]:
            place = tuple(p["position_m"])
            check(place not in points, "told twice: %s" % p)
            points[place] = p
        cursor, changed, pages = page["cursor"], changed or page["changed"], pages + 1
    return points, changed, pages


def surface(bench):
    """The same points in any pages as in the export, tagged alike; a cursor of nobody is refused."""
    conf(bench)
    client = asked(*dive(bench))
    points, changed, pages = surface_of(client, count=50)
    again, _, fewer = surface_of(client, count=1024)
    check(points == again and pages > fewer, "%d pages and %d tell different points" % (pages, fewer))
    check(not changed, "nothing has happened, and changed is said")
    with open(done(client, "map_export", name="surface", format="ply"), "rb") as f:
        head, data = f.read().split(b"end_header\n", 1)
    check(len(points) == len(data) // 40 > 1000, "%d points, exported %d" % (len(points), len(data) // 40))
    heard = sum(p["tag"] == "echo" for p in points.values())
    check(heard == sum(data[36::40]) > 100, "%d of them heard" % heard)
    for cursor in ("", "1", "1.2.3.4.5", "a.b.c.d", "1.-2.3.4", 7, "9" * 60):
        expect_refusal(client, "surface", {"cursor": cursor}, "cursor", -32602)
    far = client.call("surface", cursor="4294967295.999999999999999999.1.1")
    check(far["points"] == [] and far["cursor"] is None and far["changed"], "behind the end: %s" % far)
    page = client.call("surface", count=1)
    client.call("map_move", id=1, position_m=[0, 0, 2])
    check(client.call("surface", cursor=page["cursor"])["changed"], "a submap was moved, and nothing is said")
    note("%d points, %d of them heard, in %d pages" % (len(points), heard, pages))


def moves(bench):
    """A submap that lies elsewhere than was thought: its water goes with it, into files and back."""
    conf(bench)
    client = asked(*dive(bench))
    first, second = client.call("map_submaps")["submaps"]
    check((first["current"], second["current"]) == (False, True), "the second is the current one: %s" % second)
    client.call("map_new")
    north, east, down = first["position_m"]
    moved = client.call("map_move", id=first["id"], position_m=[north + 100, east, down], attitude_deg=[0, 0, 90])
    check(moved["moved"] and abs(moved["quaternion"][3] - math.sin(math.pi / 4)) < 1e-6, "not turned: %s" % moved)
    # what was 7 m ahead of its base is now 7 m to the east of the new one
    def place(ahead):
        return state_of(client, "point", position_m=[north + 100, east + ahead, down])
    check(place(7) == "free" and place(12) != "free", "it did not go there")
    done(client, "map_save", name="moved")
    done(client, "map_load", name="moved")
    check(place(7) == "free" and client.call("map_submaps")["submaps"][0]["moved"], "not saved as it lies")
    expect_refusal(client, "map_move", {"id": 999, "position_m": [0, 0, 0]}, "no such submap", -32602)
    expect_refusal(client, "map_move", {"id": 1}, "position_m", -32602)
    expect_refusal(client, "map_move", {"id": 0, "position_m": [0, 0, 0]}, "id", -32602)


def same_file(bench):
    """A capture with 0, 1 and 2 threads: the same bytes."""
    trip, moved_s = dive(bench)
    sums = set()
    for threads in ("0", "1", "2", "0"):
        client = asked(trip, moved_s, "--threads", threads)
        with open(done(client, "map_save", name="replayed"), "rb") as f:
            sums.add(hashlib.sha256(f.read()).hexdigest())
        client.close()
        bench.processes[-1].stop()
    check(len(sums) == 1, "maps differ: %s" % sums)


def exports(bench):
    """The surface and the volume in the formats of others."""
    conf(bench)
    client = asked(*dive(bench))
    with open(done(client, "map_export", name="surface"), "rb") as f:
        head, body = f.read().split(b"end_header\n", 1)
    count = int(head.split(b"element vertex ")[1].split()[0])
    check(len(body) == 40 * count and count > 1000, "%d bytes of %d points" % (len(body), count))
    heard = 0
    for east, north, up, nx, ny, nz, tag in struct.iter_unpack("<3d3fB3x", body):
        check(clearance((north, east)) > -VOXEL / 2, "a point behind a wall: %g %g %g" % (north, east, up))
        length = math.hypot(nx, ny, nz)
        check(abs(length - 1) < 1e-5 or length == 0, "a normal of length %g" % length)
        heard += tag
    check(0 < heard < count, "%d of %d points are of echoes" % (heard, count))
    done(client, "map_save", name="one")
    slip = bench.sonarctl("map", "load", "on")
    check(slip.returncode != 0 and "no such map; there are: one" in slip.stderr, slip.stderr)
    mcap = done(client, "map_export", name="surface", format="mcap")
    told = bench.sonarctl("capture", "info", mcap)
    check(told.returncode == 0 and "/map/surface" in told.stdout, told.stdout + told.stderr)
    tree = done(client, "map_export", name="tree", format="bt")
    note("%d points, %d of them heard; %d bytes of tree" % (count, heard, os.path.getsize(tree)))
    with open(tree, "rb") as f:
        head = f.read(200)
    check(head.startswith(b"# Octomap OcTree binary file") and float(head.split(b"\nres ")[1].split()[0]) == VOXEL, str(head))


def edge(bench):
    """Near the sonar all of the beam is free, however little of it `opening` takes farther off."""
    conf(bench, opening=0.1)
    trip = ping360(bench)
    stay(trip, [0.0, 0.0, 2.0], 25)
    client = trip.client()
    check(state_of(client, "point", position_m=[2.3, 0.3, 1.7]) == "free", "7 degrees above a beam of 25")
    check(state_of(client, "point", position_m=[2.3, 0.3, 1.1]) == "unknown", "beside the beam")


run([("map_" + f.__name__, f) for f in (basin, files, jumps, farther_than_it_goes, veil, surface, moves, same_file, exports, edge)])
