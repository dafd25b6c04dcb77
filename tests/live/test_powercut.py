#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The power fails 215 times while maps and backgrounds are saved: the newest whole one comes back, never a torn one.

tests/lib/powercut.c kills the daemon at a random step of a save; what no sync had confirmed by then the test tears,
empties or undoes, as a disk may. Then the daemon starts again and must have what was confirmed, or what came after.
SONARD_SEED repeats a run."""
import os
import random
import signal
import time

from lib import SANITIZER, SEED, Skipped, check, helper, note, pings_until, run, until

STEPS = 5  # of one save: write, sync, rename, sync of the folder; and one more


def content(path):
    try:
        with open(path, "rb") as f:
            return f.read()
    except FileNotFoundError:
        return None


class Disk:
    """A folder, and what of it is sure to be there after the power has failed."""

    def __init__(self, bench, dice):
        self.folder = bench.path("disk")
        self.dice = dice
        self.did = {"torn": 0, "emptied": 0, "undone": 0}
        os.mkdir(self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def environment(self, at):
        return {"LD_PRELOAD": helper("powercut.so"), "POWERCUT_FOLDER": self.folder, "POWERCUT_AT": str(at)}

    def tear(self, path):
        data = content(path) or b""
        way = self.dice.randrange(3)
        if way == 0:
            self.did["emptied"] += 1
            data = b""
        elif way == 1 and len(data) > 1:
            self.did["torn"] += 1
            at = self.dice.randrange(len(data))
            data = data[:at] + bytes(min(4096, len(data) - at)) + data[at + 4096:]
        with open(path, "wb") as f:
            f.write(data)

    def fail(self):
        """Unconfirmed bytes and names are lost, or not. Forgets the journal."""
        dirty, renamed = set(), None
        for line in (content(self.path("journal")) or b"").decode().splitlines():
            what, *names = line.split()
            if what == "write":
                dirty.add(names[0])
            elif what == "sync":
                dirty.discard(names[0])
                renamed = None if names[0] == "." else renamed
            else:
                renamed = names
                dirty = {names[1] if name == names[0] else name for name in dirty}
        for name in dirty:
            self.tear(self.path(name))
        if renamed and self.dice.randrange(2):
            self.did["undone"] += 1
            os.rename(self.path(renamed[1]), self.path(renamed[0]))
            if os.path.exists(self.path("was")):
                os.rename(self.path("was"), self.path(renamed[1]))
        for name in ("journal", "was"):
            if os.path.exists(self.path(name)):
                os.remove(self.path(name))


def save_until_killed(bench, disk, dice, file, begin, save):
    """Saves again and again until the power fails; returns what was confirmed last (None: nothing)."""
    confirmed = content(disk.path(file))
    daemon = bench.sonard(env=disk.environment(dice.randrange(1, 3 * STEPS)))
    daemon.expected = -signal.SIGKILL
    try:
        client = daemon.client()
        begin(client)
        while True:
            save(client)
            now = content(disk.path("journal"))
            # the sync of the folder comes last of all; until then the old one may come back as well
            if now is not None and now.rstrip().endswith(b"sync ."):
                confirmed = content(disk.path(file))
    except Exception:  # the connection ends whenever the power fails
        check(daemon.wait() == -signal.SIGKILL, "not killed: " + daemon.log())
    return confirmed


def rounds(bench, count, file, loaded, begin, save, number):
    dice = random.Random(SEED + number)
    disk = Disk(bench, dice)
    for i in range(count):
        confirmed = save_until_killed(bench, disk, dice, file, begin, save)
        newest = content(disk.path(file))
        disk.fail()
        back = content(disk.path(file))
        check(back in (confirmed, newest), "seed %d, round %d: %s bytes came back; %s were confirmed, %s newest" %
              (SEED, i, *(len(x) if x else x for x in (back, confirmed, newest))))
        daemon = bench.sonard()
        client = daemon.client()
        client.call("version")
        log = daemon.log()
        check(("loaded from" in log) == (back is not None), "seed %d, round %d: %s" % (SEED, i, log))
        check(back is None or loaded(client), "seed %d, round %d: an empty one" % (SEED, i))
        check(not os.path.exists(disk.path(file + ".damaged")), "seed %d, round %d: a torn one" % (SEED, i))
        client.close()
        daemon.stop()
        for process in (bench.processes.pop(), bench.processes.pop()):
            os.remove(process.log_path)
    note("the power failed %d times over %s, seed %d: %s" % (count, file, SEED, disk.did))
    check(sum(disk.did.values()), "the disk lost nothing: this test shows nothing")


def preloadable():
    if SANITIZER:
        raise Skipped("a sanitizer needs to be loaded first")


def said(client):
    client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 2])
    return client.call("map")


def maps(bench, count, number):
    preloadable()
    bench.sim()
    bench.conf(pose={"max_age": "60 s"}, map={"voxel": "0.5 m", "directory": bench.path("disk"), "load": "last"})

    def begin(client):
        until(lambda: said(client)["pings"] > 3, "pings in the map")

    def save(client):
        client.call("map_save", name="last")
        until(lambda: said(client)["job"]["state"] != "running", "the save", every_s=0.001)
        check(client.call("map")["job"]["state"] == "done", "not saved: %s" % client.call("map")["job"])
    rounds(bench, count, "last.map", lambda client: client.call("map")["used_bytes"] > 0, begin, save, number)


def backgrounds(bench, count, number):
    preloadable()
    bench.sim("--frame", "200,20,0.8", "--ms-per-gradian", "0.2", "--processing-ms", "0.5", quick=False)
    bench.conf(sonar={"background": os.path.join(bench.path("disk"), "head.bg"), "step": "9 deg"})

    def begin(client):
        if client.call("background")["template"] is None:
            pings_until(client, 3)
            client.call("background_learn", pings=2, motion="any")
            until(lambda: client.call("background")["template"], "the template to be learnt", 60, 0.05)

    def save(client):
        client.call("background_save")
    rounds(bench, count, "head.bg", lambda client: client.call("background")["template"], begin, save, number)


def kept_backgrounds(bench, count, number):
    """As backgrounds(), saved by save_every alone: the thread that writes them is killed at any step."""
    preloadable()
    bench.sim("--frame", "200,20,0.8", "--ms-per-gradian", "0.2", "--processing-ms", "0.5", quick=False)
    bench.conf(sonar={"background": os.path.join(bench.path("disk"), "head.bg"), "step": "18 deg"},
               background={"save_every": "1 s"})

    def save(client):
        until(lambda: client.call("background_learn", pings=2, motion="any"), "a ping to learn from")
        until(lambda: client.call("background")["learning"] is None, "the template to be learnt", 60, 0.05)
        until(lambda: client.call("background")["template"]["saved"], "the template to be kept", 60, 0.05)
    rounds(bench, count, "head.bg", lambda client: client.call("background")["template"],
           lambda client: pings_until(client, 3), save, number)


def background_by_itself(bench):
    """save_every in [background]: kept while it runs, and at the stop; not written again unless another was learnt."""
    file = os.path.join(bench.path("kept"), "head.bg")
    bench.sim("--frame", "200,20,0.8", "--ms-per-gradian", "0.2", "--processing-ms", "0.5", quick=False)

    def start(save_every):
        bench.conf(sonar={"background": file, "step": "18 deg"}, background={"save_every": save_every})
        daemon = bench.sonard()
        client = daemon.client()
        pings_until(client, 3)
        return daemon, client

    def learn(client):
        client.call("background_learn", pings=2, motion="any")
        until(lambda: client.call("background")["learning"] is None, "the template to be learnt", 60, 0.05)
    daemon, client = start("1 s")
    learn(client)
    until(lambda: "background: not kept: " + file in daemon.log(), "a folder that is missing to be told")
    check(not client.call("background")["template"]["saved"], "it is nowhere")
    os.mkdir(bench.path("kept"))
    until(lambda: client.call("background")["template"]["saved"], "the file, now that its folder is there")
    first = os.stat(file)
    time.sleep(2.5)
    check(os.stat(file).st_mtime_ns == first.st_mtime_ns, "saved although nothing has changed")
    client.call("background_forget")
    time.sleep(1.2)
    check(os.stat(file).st_mtime_ns == first.st_mtime_ns, "what was cleared is no new template")
    daemon.expected = -signal.SIGKILL
    daemon.process.kill()
    daemon.wait()
    daemon, client = start("24 h")
    check(client.call("background")["template"]["saved"], "it is not back after a kill")
    learn(client)
    check(not client.call("background")["template"]["saved"], "kept at once")
    daemon.stop()
    check(os.stat(file).st_mtime_ns > first.st_mtime_ns, "not kept at the stop")


def by_itself(bench):
    """save_every and load: kept while it runs, through a kill, at the stop; never over a map of another run."""
    folder = bench.path("maps")
    sim = bench.sim()
    section = {"voxel": "0.5 m", "directory": folder, "save_every": "1 s", "load": "last"}
    bench.conf(pose={"max_age": "60 s"}, map=section)
    daemon = bench.sonard()
    client = daemon.client()
    until(lambda: "starting empty" in daemon.log(), "the map to begin empty")
    until(lambda: said(client)["pings"] > 210, "a turn")
    sim.command("silent 1000")
    until(lambda: client.call("map")["kept"], "the first save")
    time.sleep(2.5)
    rows = client.call("map_slice", middle_m=[0, 0], depth_m=2)["rows"]
    check(any("." in row for row in rows), "nothing is free")
    written = os.stat(os.path.join(folder, "last.map")).st_mtime_ns
    time.sleep(1.2)
    check(os.stat(os.path.join(folder, "last.map")).st_mtime_ns == written, "saved although nothing has changed")
    daemon.expected = -signal.SIGKILL
    daemon.process.kill()
    daemon.wait()

    def starts_with(**more):
        bench.conf(pose={"max_age": "60 s"}, map=dict(section, **more))
        again = bench.sonard()
        asked = again.client()
        return again, asked, asked.call("map_slice", middle_m=[0, 0], depth_m=2)["rows"]
    daemon, client, back = starts_with()
    check(back == rows and client.call("map")["kept"]["what"] == "load", "the map is not the same after a kill")
    client.call("map_forget")
    daemon.stop()
    daemon, client, back = starts_with()
    check(not any("." in row for row in back), "what was forgotten is back")
    sim.command("silent 0")
    until(lambda: said(client)["pings"] > 210, "another turn")
    sim.command("silent 1000")
    time.sleep(0.3)
    rows = client.call("map_slice", middle_m=[0, 0], depth_m=2)["rows"]
    daemon.stop()
    daemon, client, back = starts_with(load="none")
    check(not any("." in row for row in back), "loaded, and nobody asked for it")
    client.call("map_load", name="before")
    until(lambda: client.call("map")["job"]["state"] == "done", "the load")
    check(client.call("map_slice", middle_m=[0, 0], depth_m=2)["rows"] == rows, "not saved at the stop")
    refused = bench.sonarctl("map", "save", "last")
    check(refused.returncode != 0 and "save_every" in refused.stderr, "its name may be taken: " + refused.stderr)


cases = [("powercut_maps%d" % n, lambda bench, n=n: maps(bench, 50, n)) for n in range(3)]
cases += [("powercut_backgrounds", lambda bench: backgrounds(bench, 50, 3)), ("powercut_by_itself", by_itself)]
cases += [("powercut_kept_backgrounds", lambda bench: kept_backgrounds(bench, 15, 4)),
          ("powercut_background_by_itself", background_by_itself)]
run(cases, parallel=5)
