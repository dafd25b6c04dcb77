#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""[realtime]: the kernel gives what it was asked for, to the threads that a ping goes through and to no other; or
sonard does not start and says what is missing."""
import glob
import json
import os
import resource
import subprocess
import threading
import time

from lib import Failed, SANITIZER, SCHEMAS, SONARD, Skipped, check, note, pings_until, run

OTHER, FIFO, BATCH = 0, 1, 3
SECONDS = 15
ONE_AT_A_TIME = threading.Lock()


def may(priority):
    """May this process ask for it?"""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    except PermissionError:
        raise Skipped("this user may not have SCHED_FIFO") from None


def threads(pid):
    """[(policy, priority, processors)], the loop first."""
    found = []
    for task in sorted(int(os.path.basename(t)) for t in glob.glob("/proc/%d/task/*" % pid)):
        found.append((os.sched_getscheduler(task) & ~os.SCHED_RESET_ON_FORK,
                      os.sched_getparam(task).sched_priority, os.sched_getaffinity(task)))
    return found


def locked_kb(pid):
    with open("/proc/%d/status" % pid, encoding="ascii") as f:
        return int(next(line.split()[1] for line in f if line.startswith("VmLck:")))


def priorities(bench):
    if SANITIZER == "thread":
        raise Skipped("a sanitizer that runs a thread of its own")
    may(40)
    bench.sim()
    bench.conf(pipeline={"threads": 2}, realtime={"priority": 40})
    daemon = bench.sonard("--record", bench.path("captures"))
    pings_until(daemon.client(), 5)
    found = [(policy, priority) for policy, priority, _ in threads(daemon.pid)]
    check(found == [(FIFO, 40), (FIFO, 39), (FIFO, 39), (OTHER, 0)] or
          found == [(FIFO, 40), (FIFO, 39), (FIFO, 39), (OTHER, 0), (OTHER, 0)],
          "loop, extract, maps, and the one that writes captures: %s" % found)


def processors(bench):
    if SANITIZER == "thread":
        raise Skipped("a sanitizer that runs a thread of its own")
    last = max(os.sched_getaffinity(0))
    bench.sim()
    bench.conf(pipeline={"threads": 1}, realtime={"processor": last})
    daemon = bench.sonard()
    pings_until(daemon.client(), 5)
    found = [(policy, cpus) for policy, _, cpus in threads(daemon.pid)]
    # beside the loop and the stage, the worker, which looks up the users of [server] keep
    check(found[:2] == [(OTHER, {last}), (BATCH, {last})] and all(thread == (OTHER, {last}) for thread in found[2:]),
          "all threads on processor %d, the loop before the stage: %s" % (last, found))


def request(method, /, **params):
    """A line that asks for the method, under its name."""
    return json.dumps({"jsonrpc": "2.0", "id": method, "method": method, "params": params}).encode() + b"\n"


def one_processor(bench, threads):
    """The loop puts the pipeline's threads aside wherever they are, and never waits for what they were about to publish:
    every method is answered. A thread that runs for 5 s of its own time without a pause is ended by the kernel."""
    if SANITIZER:
        raise Skipped("a sanitizer is too slow for RLIMIT_RTTIME")
    may(40)
    names = ["s%d" % i for i in range(8)]
    sims = [bench.twin("surveyor_sim", "--udp", "0", "--points", "512", "--bottom", "1", "--wall", "0") for _ in names]
    sonars = "".join("[sonar %s]\ndevice = surveyor\nport = udp:%s\nrange = 4 m\n" % pair
                     for pair in zip(names, (sim.address for sim in sims)))
    rest = ("[server]\nsocket = %s\n[log]\nlevel = warning\n[pipeline]\nthreads = %d\n[realtime]\npriority = 40\n"
            "[map]\nvoxel = 0.2 m\nmemory = 8 MiB\ndirectory = %s\n" % (bench.socket_path, threads, bench.folder))
    daemon = bench.sonard("--record", bench.path("captures"), conf=bench.write("sonard.conf", sonars + rest))
    client = daemon.client()
    for task in glob.glob("/proc/%d/task/*" % daemon.pid):
        os.sched_setaffinity(int(os.path.basename(task)), {min(os.sched_getaffinity(0))})
    resource.prlimit(daemon.pid, resource.RLIMIT_RTTIME, (5000000, resource.RLIM_INFINITY))
    pings_until(client, 20)
    every = [(method, request(method, **SCHEMAS.needed(method))) for method in SCHEMAS.methods()]
    images = [("image", request("image", sensor=name)) for name in names]
    answers, end = 0, time.monotonic() + SECONDS
    while time.monotonic() < end:
        for method, line in every + images * 10:
            client.send(line)
            reply = client.reply()
            if reply is None:
                raise Failed("after %d answers '%s' ended the daemon with %d" % (answers, method, daemon.wait()))
            check(reply["id"] == method, "'%s' was answered by %s" % (method, reply))
            answers += 1
    pings_until(client, 20)
    note("%d answers with %d threads" % (answers, threads))


def alone(case, bench, threads):
    """Two such daemons on the same processor would leave each other no pause."""
    with ONE_AT_A_TIME:
        case(bench, threads)


def memory(bench):
    if SANITIZER:
        raise Skipped("a sanitizer's shadow memory cannot be locked")
    if os.geteuid() != 0:
        raise Skipped("only root may lock as much here")
    bench.sim()
    bench.conf(pipeline={"threads": 2}, realtime={"lock_memory": "on"})
    daemon = bench.sonard()
    pings_until(daemon.client(), 5)
    kb = locked_kb(daemon.pid)
    note("%d KiB locked" % kb)
    check(kb > 8192, "locked: %d KiB" % kb)


def refused(bench, key, value, says):
    """As a user without rights, whose limits are none."""
    if os.geteuid() != 0:
        raise Skipped("needs root, to become nobody")
    conf = bench.conf(realtime={key: value})
    os.chmod(os.path.dirname(conf), 0o755)
    ended = subprocess.run(["prlimit", "--rtprio=0", "--memlock=65536", "setpriv", "--reuid=65534", "--regid=65534",
                            "--clear-groups", "--bounding-set=-all", "--inh-caps=-all", SONARD, "-c", conf,
                            "--socket", "none"], capture_output=True, text=True, timeout=30, check=False)
    check(ended.returncode == 1 and says in ended.stderr, "status %d: %s" % (ended.returncode, ended.stderr))


run([("priorities", priorities), ("processors", processors), ("memory", memory),
     ("one_processor_1_thread", lambda b: alone(one_processor, b, 1)),
     ("one_processor_2_threads", lambda b: alone(one_processor, b, 2)),
     ("refused_priority", lambda b: refused(b, "priority", 40, "[realtime] priority: Operation not permitted")),
     ("refused_memory", lambda b: refused(b, "lock_memory", "on", "LimitMEMLOCK=infinity")),
     ("refused_processor", lambda b: refused(b, "processor", 511, "[realtime] processor: Invalid argument; this computer"))],
    parallel=3, gate=("processors",))
