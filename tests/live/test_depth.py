#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""test_depth - the depth of a virtual Modbus transmitter, over a pseudo-terminal and over TCP: right values, every fault
of the slave, and a sonar that never waits for it."""
import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from lib import BUILD, Process, check, free_port, pings_until, run, until  # noqa: E402

FAST = {"rate": "20 Hz", "timeout": "100 ms", "turnaround": "400 ms", "speed_limit": "100 m/s"}


class Transmitter(Process):
    def __init__(self, bench, *arguments):
        super().__init__(bench, "modbus_sim", [os.path.join(BUILD, "tests", "modbus_sim"), *arguments],
                         stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        bench.processes.append(self)
        check(self.process.stdout.readline().startswith(b"ready "), "the transmitter does not start: " + self.log())

    def command(self, text):
        self.process.stdin.write(text.encode() + b"\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().decode()
        check(answer.startswith("ok"), "%s: %s" % (text, answer))

    def stop(self):
        status = super().stop()
        self.process.stdin.close()
        self.process.stdout.close()
        return status


def rtu(bench, **keys):
    transmitter = Transmitter(bench, "rtu", bench.path("depth"))
    bench.conf(depth=dict(FAST, source="modbus-rtu:%s:9600" % bench.path("depth"), **keys))
    bench.sonard()
    return transmitter, bench.processes[-1].client()


def depth(client):
    return client.call("status")["depth"]


def settles(client, metres):
    until(lambda: abs((depth(client)["depth_m"] or 0) - metres) < 0.01, "%g m" % metres)


def follows(bench):
    transmitter, client = rtu(bench)
    settles(client, 10)
    check("depth" in client.call("status")["pose"]["has"], "the pose has no depth")
    transmitter.command("depth 12.5")
    settles(client, 12.5)
    status = depth(client)
    check(status["state"] == "running" and status["error"] == "", "it is not running: %s" % status)


def over_tcp(bench):
    port = free_port()
    transmitter = Transmitter(bench, "tcp", str(port))
    bench.conf(depth=dict(FAST, source="modbus-tcp:127.0.0.1:%d" % port))
    client = bench.sonard().client()
    settles(client, 10)
    transmitter.command("hangup")
    transmitter.command("depth 11")
    settles(client, 11)
    transmitter.command("late 250")
    transmitter.command("depth 14")
    until(lambda: depth(client)["timeouts"] > 0, "a time-out")
    transmitter.command("late 0")
    settles(client, 14)


def late(bench):
    """The answer to an old question is never taken for that to a new one."""
    transmitter, client = rtu(bench)
    settles(client, 10)
    transmitter.command("late 250")
    until(lambda: depth(client)["timeouts"] > 2, "time-outs")
    samples = depth(client)["samples"]
    until(lambda: depth(client)["timeouts"] > 5, "more time-outs")
    check(depth(client)["samples"] == samples, "an answer that came too late was taken")
    transmitter.command("depth 20")
    transmitter.command("late 0")
    until(lambda: depth(client)["samples"] > samples, "an answer in time")
    check(abs(depth(client)["depth_m"] - 20) < 0.01, "the first answer is old: %s" % depth(client))


def later_than_promised(bench):
    """Later than the quiet time: no old depth is taken, neither while it lasts nor when it ends."""
    transmitter, client = rtu(bench)
    settles(client, 10)
    transmitter.command("late 700")
    until(lambda: depth(client)["timeouts"] > 0, "a time-out")
    transmitter.command("depth 20")  # all that is asked from here on
    samples = depth(client)["samples"]
    until(lambda: depth(client)["timeouts"] > 4, "more time-outs")
    check(depth(client)["samples"] == samples or abs(depth(client)["depth_m"] - 20) < 0.01, "%s" % depth(client))
    transmitter.command("late 0")
    until(lambda: depth(client)["samples"] > samples, "an answer in time")
    check(abs(depth(client)["depth_m"] - 20) < 0.01, "the first answer is old: %s" % depth(client))


def fault(bench, name, counters):
    transmitter, client = rtu(bench)
    settles(client, 10)
    transmitter.command("%s 2" % name)
    transmitter.command("depth 11")
    until(lambda: any(depth(client)[counter] for counter in counters), "the fault to be counted")
    settles(client, 11)


def refused(bench):
    """A slave that answers with exceptions is there: it is not called silent."""
    transmitter, client = rtu(bench)
    settles(client, 10)
    transmitter.command("exception 1000000")
    until(lambda: depth(client)["state"] == "refused", "the refusals to be told")
    check("check function, register and type" in bench.processes[-1].log(), "no advice")
    transmitter.command("exception 0")
    until(lambda: depth(client)["state"] == "running", "it to answer again")


def lying(bench):
    transmitter, client = rtu(bench, plausible="-1 100 m")
    settles(client, 10)
    transmitter.command("lie 2000 1000000")
    until(lambda: "rejected" in depth(client)["error"], "the reason")
    until(lambda: depth(client)["implausible"] >= 5, "five lies")
    transmitter.command("lie 2000 0")
    settles(client, 10)


def silent(bench):
    """Silence is told, the depth ends by itself, the sonar goes on."""
    transmitter, client = rtu(bench)
    bench.sim()
    settles(client, 10)
    transmitter.command("silent")
    until(lambda: depth(client)["state"] == "silent", "the silence to be told")
    pings_until(client, 20)
    until(lambda: depth(client)["age_s"] > 1, "the depth to age")
    transmitter.command("good")
    until(lambda: depth(client)["state"] == "running", "it to answer again")


def unplugged(bench):
    transmitter, client = rtu(bench)
    settles(client, 10)
    transmitter.command("unplug")
    until(lambda: depth(client)["state"] == "no link", "the loss to be told")
    transmitter.command("depth 12")
    transmitter.command("plug")
    settles(client, 12)
    check(depth(client)["reconnects"] == 1, "it was not counted")
    log = bench.processes[-1].log()
    check(log.count("retrying until it opens") <= 2, "said more than once:\n" + log)


def missing(bench):
    """A slave that is not there when sonard starts does not keep it from starting, or from ending."""
    bench.conf(depth=dict(FAST, source="modbus-rtu:%s:9600" % bench.path("depth")))
    client = bench.sonard().client()
    until(lambda: depth(client)["state"] == "no link", "the lack to be told")
    Transmitter(bench, "rtu", bench.path("depth"))
    settles(client, 10)


def recorded(bench):
    """What was recorded has the depth as the `pose` method would have it."""
    folder = bench.path("captures")
    Transmitter(bench, "rtu", bench.path("depth"))
    bench.sim()
    bench.conf(depth=dict(FAST, source="modbus-rtu:%s:9600" % bench.path("depth")), record={"directory": folder})
    daemon = bench.sonard()
    client = daemon.client()
    settles(client, 10)
    pings_until(client, 20)
    daemon.stop()
    capture = os.path.join(folder, sorted(os.listdir(folder))[0])
    bench.sonard("--replay", capture, "--stay", "--socket", bench.socket_path, conf=False)
    client = bench.processes[-1].client()
    until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay")
    pose = client.call("status")["pose"]
    check(pose["count"] > 3 and pose["refused"] == 0, "the replay's poses: %s" % pose)


# What libmodbus makes of garbage depends on its second byte: a function it knows, or none.
FAULTS = (("exception", ["exceptions"]), ("bad_crc", ["bad_answers"]), ("wrong_slave", ["bad_answers"]),
          ("garbage", ["bad_answers", "timeouts"]), ("cut", ["timeouts"]), ("silent", ["timeouts"]),
          ("stray", ["out_of_step"]))

cases = [(f.__name__, f) for f in (follows, over_tcp, late, later_than_promised, refused, lying, silent, unplugged, missing, recorded)]
for fault_name, counter_names in FAULTS:
    cases.append(("fault_" + fault_name, lambda bench, a=(fault_name, counter_names): fault(bench, *a)))

run(cases, parallel=6)
