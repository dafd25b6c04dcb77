#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Bytes of file names and of map files that are no text: every answer stays JSON in UTF-8, every line of the log ours."""
import os
import shutil
import signal
import subprocess
import time
import zlib

from lib import SANITIZER, SONARD, check, note, run, until

MAP = {"voxel": "0.1 m", "memory": "8 MiB", "extent": "20 m", "height": "4 m"}
FORGED = b"sonard: error: leak: water"


def settled(client):
    return until(lambda: (job := client.call("map")["job"]) and job["state"] != "running" and job, "the job's end")


def start(bench):
    folder = bench.path("maps").encode()
    os.mkdir(folder)
    bench.conf(map=dict(MAP, directory=bench.path("maps")))
    daemon = bench.sonard()
    return folder, daemon, daemon.client()


def check_log(daemon):
    check(not [line for line in daemon.log().splitlines() if line.encode().startswith(FORGED)], "a line is forged")


def write(path, content):
    with open(path, "wb") as f:
        f.write(content)


def names(bench):
    """Of other maps in the folder, in the message that lists them, cut anywhere."""
    folder, daemon, client = start(bench)
    write(folder + b"/Hafen-\xfc.map", b"x")
    write(folder + b"/a\n" + FORGED + b".map", b"x")
    for _ in range(2):
        client.call("map_load", name="nothere")
        job = settled(client)
        check(job["state"] == "failed" and "Hafen-?" in job["message"], str(job))
        client.call("map_forget")
    for n in range(60):
        write(folder + b"/" + 9 * "ü".encode() + b"%d.map" % n, b"x")
    for name in ("x", "xx", "xxx", "xxxx"):
        client.call("map_load", name=name)
        check("ü" in settled(client)["message"], "the names are lost")
    check_log(daemon)


def origin(bench):
    """What a map says of where its places count from."""
    folder, daemon, client = start(bench)
    client.call("map_save", name="a")
    check(settled(client)["state"] == "done", "not saved")
    with open(folder + b"/a.map", "rb") as f:
        whole = bytearray(f.read()[:-4])
    whole[40:96] = (b"\xff harbour\n" + FORGED).ljust(56, b"\0")
    write(folder + b"/b.map", bytes(whole) + zlib.crc32(bytes(whole)).to_bytes(4, "little"))
    client.call("map_load", name="b")
    job = settled(client)
    check(job["state"] == "failed" and "? harbour?sonard" in job["message"], str(job))
    check_log(daemon)


def sparse(bench):
    """A map file of 3 GiB is refused before it is read."""
    folder, daemon, client = start(bench)
    client.call("map_save", name="a")
    check(settled(client)["state"] == "done", "not saved")
    shutil.copy(folder + b"/a.map", folder + b"/b.map")
    os.truncate(folder + b"/b.map", 3 << 30)
    write(folder + b"/c.map", b"")
    os.truncate(folder + b"/c.map", 3 << 30)
    for name, why in (("b", "3221225472 bytes are more than memory in [map] allows"), ("c", "not a map")):
        client.call("map_load", name=name)
        job = settled(client)
        check(job["state"] == "failed" and why in job["message"], str(job))
    with open("/proc/%d/status" % daemon.process.pid, encoding="ascii") as f:
        most = int([line for line in f if line.startswith("VmHWM")][0].split()[1])
    check(SANITIZER or most < 256 * 1024, "it took %d KiB" % most)
    note("memory at most %d KiB" % most)


def capture(bench):
    """The path of a capture stands in status."""
    path = bench.path("").encode() + b"d\xfc.mcap"
    shutil.copy("tests/replay/box.mcap", path)
    client = bench.sonard("--replay", path, "--stay", "--socket", bench.socket_path, conf=False).client()
    check("d?.mcap" in client.call("status")["config"], "the path")


def fifo_beside(bench):
    """A FIFO in the place of the file that a save writes first: the save fails, the next one is taken, and sonard ends."""
    folder, daemon, client = start(bench)
    os.mkfifo(folder + b"/a.map.new")
    client.call("map_save", name="a")
    job = settled(client)
    check(job["state"] == "failed" and "a.map.new is there and is no regular file" in job["message"], str(job))
    client.call("map_save", name="b")
    check(settled(client)["state"] == "done", "the next save")
    check(os.path.exists(folder + b"/a.map.new"), "what is not sonard's is gone")
    check(daemon.stop() == 0, "the stop")


def fifo_as_drop_in(bench):
    """At reload, and as the configuration itself."""
    _, daemon, client = start(bench)
    path = bench.path("sonard.conf")
    os.mkdir(path + ".d")
    os.mkfifo(path + ".d/x.conf")
    daemon.process.send_signal(signal.SIGHUP)
    until(lambda: "not a regular file" in daemon.log(), "the fault")
    client.call("version")
    os.unlink(path + ".d/x.conf")
    os.unlink(path)
    os.mkfifo(path)
    daemon.process.send_signal(signal.SIGHUP)
    until(lambda: "cannot be read again" in daemon.log(), "the fault")
    client.call("version")


def closed_descriptors(bench):
    """Started with none of the first three: no line of the log comes into a file that took their place."""
    bench.conf()
    out = bench.path("out.jsonl")
    made = subprocess.Popen(["sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh", SONARD, "-c", bench.path("sonard.conf"),
                             "--answers", out, "--every", "0.2"])
    until(lambda: os.path.exists(bench.socket_path), "the socket")
    time.sleep(0.5)
    places = [os.readlink("/proc/%d/fd/%d" % (made.pid, fd)) for fd in range(3)]
    made.terminate()
    check(made.wait(20) == 0, "it ended with %s" % made.returncode)
    check(places == 3 * ["/dev/null"], "descriptors 0 to 2 are %s" % places)
    with open(out, encoding="ascii") as f:
        lines = f.read().splitlines()
    check(lines and all(line.startswith("{") for line in lines), "the log is in the answers: %s" % lines[:1])


run([("outside_names", names), ("outside_origin", origin), ("outside_capture", capture), ("outside_sparse", sparse),
     ("outside_fifo_beside", fifo_beside), ("outside_fifo_as_drop_in", fifo_as_drop_in),
     ("outside_closed_descriptors", closed_descriptors)], parallel=3,
    gate=("outside_names", "outside_origin", "outside_capture", "outside_sparse", "outside_fifo_beside", "outside_fifo_as_drop_in"))
