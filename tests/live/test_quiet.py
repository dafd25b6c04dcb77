#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""After start-up the way of a ping allocates nothing and faults no page, with any number of threads. Where nothing
happens the daemon sleeps."""
import glob
import os
import re
import signal

from lib import SANITIZER, Skipped, check, helper, note, pings_until, run, until

TURN = 200   # pings of a full circle at 1.8 degrees
PINGS = 250  # that are watched


def page_faults(pid):
    """Minor and major faults of each thread."""
    faults = {}
    for path in glob.glob("/proc/%d/task/*/stat" % pid):
        with open(path, encoding="ascii") as f:
            fields = f.read().rsplit(")", 1)[1].split()  # the name before may have blanks; [0] is field 3
        faults[os.path.basename(os.path.dirname(path))] = int(fields[10 - 3]) + int(fields[12 - 3])
    return faults


def counted(bench, daemon, lines):
    """Allocations and frees since the signal before."""
    path = bench.path("mcount")
    daemon.process.send_signal(signal.SIGUSR2)

    def report():
        with open(path, encoding="ascii") as f:
            found = re.findall(r"allocations (\d+) frees (\d+)", f.read())
        return found[lines - 1] if len(found) >= lines else None
    return [int(n) for n in until(report, "the count of allocations")]


def measure(bench, threads, *arguments):
    """Allocations, frees and page faults during PINGS pings without any client."""
    if SANITIZER:
        raise Skipped("a sanitizer allocates and faults by itself")
    sim = bench.sim()
    bench.conf(pipeline={"threads": threads}, log={"level": "info"})
    bench.write("mcount", "")
    daemon = bench.sonard(*arguments, env={"LD_PRELOAD": helper("mcount.so"),
                                           "MCOUNT_OUT": bench.path("mcount")})
    client = daemon.client()
    pings_until(client, TURN + 20)
    client.leave()  # else its end may be counted as the pings'
    check(counted(bench, daemon, 1)[0] > 0, "the allocations of the start were not counted")
    first = sim.pings()
    before = page_faults(daemon.pid)
    check(sum(before.values()) > 0, "the page faults of the start were not counted")
    until(lambda: sim.pings() >= first + PINGS, "%d pings" % PINGS, 60, 0.2)
    after = page_faults(daemon.pid)
    pings = sim.pings() - first
    allocations, frees = counted(bench, daemon, 2)
    expected = threads + 2 + ("--record" in arguments)  # with the worker, and one that writes captures
    check(len(after) == expected, "%d threads, expected %d" % (len(after), expected))
    client = daemon.client()
    until(lambda: client.sensor()["pings"] >= first + pings, "the daemon to have taken the pings")
    return pings, allocations, frees, sum(after.values()) - sum(before.values())


def quiet(bench, threads):
    pings, allocations, frees, faults = measure(bench, threads)
    note("threads = %d: %d pings, %d allocations, %d frees, %d page faults"
         % (threads, pings, allocations, frees, faults))
    check(allocations == 0 and frees == 0, "%d allocations and %d frees" % (allocations, frees))
    check(faults == 0, "%d page faults" % faults)


def recording(bench):
    """While recording too: chunks are compressed and written in memory that was there from the start."""
    pings, allocations, frees, faults = measure(bench, 2, "--record", bench.path("captures"))
    note("recording: %d pings, %d allocations, %d frees, %d page faults" % (pings, allocations, frees, faults))
    check(allocations == 0 and frees == 0, "%d allocations and %d frees" % (allocations, frees))
    check(faults == 0, "%d page faults" % faults)


def at_rest(bench):
    """The loop sleeps between its ticks while it records, too: one that looks again and again never waits."""
    bench.conf()  # of a sonar that is not there
    daemon = bench.sonard("--record", bench.path("captures"))
    daemon.client().leave()

    def slept():
        with open("/proc/%d/status" % daemon.pid, encoding="ascii") as f:
            return int(re.search(r"\nvoluntary_ctxt_switches:\s+(\d+)", f.read())[1])
    before = slept()
    until(lambda: slept() >= before + 20, "the loop to sleep")


run([("threads%d" % n, lambda bench, n=n: quiet(bench, n)) for n in (0, 1, 2)] + [("recording", recording), ("at_rest", at_rest)],
    parallel=4)
