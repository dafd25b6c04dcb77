#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The configuration read anew while all goes on: all live keys or none, the others named, nothing forgotten."""
import os
import signal
import socket

from lib import check, pings_until, refused, run, until

TURN = 200  # pings of a full circle at 1.8 degrees


def echoes(client):
    return sum(row["state"] == "echo" for row in client.call("image")["rows"])


def live(bench, threads):
    """Live keys take effect at once, the others are named; grid, map and clients stay."""
    bench.sim()
    common = {"pipeline": {"threads": threads}, "pose": {"max_age": "60 s"}}
    maps = {"voxel": "0.5 m", "memory": "16 MiB"}
    bench.conf(map=maps, **common)
    client = bench.sonard().client()
    client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 5])
    pings_until(client, TURN + 20)
    before = client.call("map")["pings"]
    check(before > 0, "no ping in the map")
    heard = echoes(client)
    check(client.call("reload") == {"applied": [], "needs_restart": []}, "something is said to have changed")

    bench.conf(map=dict(maps, voxel="1 m"), grid={"clear_for": "11 s"}, extract={"floor": "65535", "median": "off"},
               water={"sound_speed": "1480 m/s"}, server={"socket": bench.socket_path, "change": "all"},
               pipeline={"threads": 1}, pose=common["pose"])
    said = client.call("reload")
    check(set(said["applied"]) == {"[grid] clear_for = 11 s", "[extract] floor = 65535", "[server] change = all"},
          "applied: %s" % said)
    check(set(said["needs_restart"]) == {"[map] voxel = 1 m", "[water] sound_speed = 1480 m/s",
                                         "[pipeline] threads = 1"}, "needs a restart: %s" % said)
    check(client.call("reload")["applied"] == [], "applied twice")
    check(client.call("map")["pings"] >= before, "the map was forgotten")
    check("blocked" in {s["state"] for s in client.call("sectors", distance_m=0)["sectors"]}, "the grid was forgotten")
    client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 5])
    pings_until(client, 2 * TURN)
    check(echoes(client) < heard / 2, "floor = 65535 is not in force: %d echoes, were %d" % (echoes(client), heard))
    server = client.call("status")["server"]
    check(server["clients_total"] == 1, "the client had to come again")


def one_sonar(bench):
    """What is changed of one sonar begins its extraction anew, and no other's; [extract] begins all."""
    side = {"device": "ping360", "port": "serial:%s" % bench.path("nothing"), "range": "10 m"}
    bench.conf(**{"sonar side": side})
    daemon = bench.sonard()
    client = daemon.client()

    def begun_anew(name):
        return daemon.log().count("%s: learning ring-down and noise again" % name)
    bench.conf(**{"sonar side": dict(side, ring_down="1.5 m")})
    check(client.call("reload")["applied"] == ["[sonar side] ring_down = 1.5 m"], "one key of one sonar")
    check((begun_anew("head"), begun_anew("side")) == (0, 1), daemon.log())
    bench.conf(extract={"floor": "9"}, **{"sonar side": dict(side, ring_down="1.5 m")})
    check(client.call("reload")["applied"] == ["[extract] floor = 9"], "one key of all sonars")
    check((begun_anew("head"), begun_anew("side")) == (1, 2), daemon.log())


def grid_limits(bench):
    """Each grid has its own, by its name."""
    bench.conf(**{"grid near": {"range": "5 m"}})
    client = bench.sonard().client()
    bench.conf(grid={"clear_for": "8 s"}, **{"grid near": {"range": "5 m", "clear_for": "9 s"}})
    client.call("reload")
    told = {grid["name"]: grid["clear_for_s"] for grid in client.call("grid_list")["grids"]}
    check(told == {"main": 8, "near": 9}, told)


def explained(bench):
    """Limits change while the grid's owner explains answers by them: a race, which the thread sanitizer sees."""
    bench.sim()
    bench.conf(pipeline={"threads": 1})
    daemon = bench.sonard()
    client, other = daemon.client(), daemon.client()
    pings_until(client, TURN + 20)
    question = b'{"jsonrpc":"2.0","id":1,"method":"explain","params":{"azimuth_deg":0,"distance_m":9,"half_angle_deg":2}}\n'
    for i in range(30):
        bench.conf(pipeline={"threads": 1}, grid={"clear_for": "%d s" % (10 + i)})
        other.send(40 * question)
        check(client.call("reload")["applied"] == ["[grid] clear_for = %d s" % (10 + i)], "clear_for is not in force")
        for _ in range(40):
            check('"result"' in str(other.line()), "no explanation")


def broken(bench):
    """A fault leaves all as it was, and says where; so do live keys that do not go with what needs a restart."""
    bench.conf(pose={"max_age": "60 s"}, grid={"forget": "160 s"})
    client = bench.sonard().client()
    client.call("pose", attitude_deg=[0, 0, 0])
    path = bench.conf(pose={"max_age": "10 ms"}, grid={"layer": "thick"}, extract={"flor": "3"})
    said = refused(client, "reload")
    check("%s:" % path in said and "1 more in the log" in said, "it says only: " + said)
    check("flor" in bench.processes[0].log() and "thick" in bench.processes[0].log(), "the log does not name both")
    check(client.call("status")["data"] != "the pose is too old", "max_age was taken from a broken file")
    bench.conf(grid={"clear_for": "200 s", "forget": "300 s"})
    said = refused(client, "reload")
    check("clear_for = 200 s" in said and "forget = 160 s" in said, "it says only: " + said)
    bench.conf(map={"rnage": "3 m"})
    said = refused(client, "reload")
    check("[map] rnage = 3 m: unknown key; expected one of voxel" in said and said.endswith(", load"), "it says only: " + said)
    os.remove(path)
    check("cannot be read" in refused(client, "reload"), "a missing file is no fault")
    bench.conf(pose={"max_age": "20 s"})
    check(client.call("reload")["applied"] == ["[pose] max_age = 20 s"], "a good file after broken ones")


def drop_in(bench):
    """A file of the folder, and sonarctl."""
    path = bench.conf()
    client = bench.sonard().client()
    os.mkdir(path + ".d")
    bench.write("sonard.conf.d/50-log.conf", "[log]\nlevel = warning\n")
    done = bench.sonarctl("reload")
    check(done.returncode == 0 and "in force       [log] level = warning\n" == done.stdout, "sonarctl says %s" % done)
    done = bench.sonarctl("reload")
    check(done.stdout == "nothing has changed\n", "sonarctl says %s" % done)
    bench.write("sonard.conf.d/60-bad.conf", "[log]\nlevel = loud\n")
    done = bench.sonarctl("reload")
    check(done.returncode == 6 and "60-bad.conf:2" in done.stderr, "sonarctl says %s" % done)
    check(client.call("version"), "the client was disturbed")


def hangup(bench):
    """SIGHUP is the same; the service manager hears of it, good or bad."""
    manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    manager.bind(bench.path("notify"))
    manager.settimeout(20)
    bench.conf()
    daemon = bench.sonard(env={"NOTIFY_SOCKET": bench.path("notify")})
    client = daemon.client()

    def hang_up():
        os.kill(daemon.pid, signal.SIGHUP)
        heard = []
        while not heard or "READY=1" not in heard[-1] or "RELOADING=1" not in "".join(heard):
            heard.append(manager.recv(4096).decode())
        check("MONOTONIC_USEC=" in "".join(heard), "no time in %s" % heard)
    bench.conf(pose={"max_age": "9 s"})
    hang_up()
    until(lambda: "1 changed, 0 need a restart" in daemon.log(), "the log to tell of it")
    bench.conf(pose={"max_age": "9"})
    hang_up()
    until(lambda: "nothing is changed" in daemon.log(), "the log to tell of the fault")
    check(client.call("version"), "the client was disturbed")


def replay(bench):
    daemon = bench.sonard("--replay", "tests/replay/box.mcap", "--stay", "--socket", bench.socket_path, conf=False)
    client = daemon.client()
    check("a replay keeps its configuration" in refused(client, "reload"), "a replay reloads")
    os.kill(daemon.pid, signal.SIGHUP)
    until(lambda: "a replay keeps its configuration" in daemon.log(), "the log to tell of it")


run([
    ("reload_live_0", lambda bench: live(bench, 0)),
    ("reload_live_2", lambda bench: live(bench, 2)),
    ("reload_one_sonar", one_sonar),
    ("reload_grid_limits", grid_limits),
    ("reload_explained", explained),
    ("reload_broken", broken),
    ("reload_drop_in", drop_in),
    ("reload_hangup", hangup),
    ("reload_replay", replay),
], parallel=2,
    gate=("reload_one_sonar", "reload_grid_limits", "reload_broken", "reload_drop_in", "reload_hangup", "reload_replay"))
