#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""sonard and the service manager: ready, how it does, the watchdog, a socket handed over, a stop within a second."""
import os
import select
import signal
import socket
import subprocess
import time

from lib import BUILD, Client, PATIENCE, SANITIZER, Skipped, check, helper, note, pings_until, run, until



class Manager:
    """What listens at NOTIFY_SOCKET."""

    def __init__(self, bench, abstract=False):
        self.address = "@sonard-test-%d-%d" % (os.getpid(), id(self)) if abstract else bench.path("notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(self.address.replace("@", "\0"))
        self.told = []  # (moment, line)
        self.env = {"NOTIFY_SOCKET": self.address}

    def listen(self):
        """All that was told so far."""
        while select.select([self.socket], [], [], 0)[0]:
            for line in self.socket.recv(4096).decode().splitlines():
                self.told.append((time.monotonic(), line))
        return [line for _, line in self.told]

    def heard(self, line, limit_s=20):
        until(lambda: line in self.listen(), "%s; heard %s" % (line, self.listen()), limit_s)

    def feeds_in(self, span_s):
        self.listen()
        self.told.clear()
        time.sleep(span_s)
        return self.listen().count("WATCHDOG=1")


def ready(bench, abstract):
    manager = Manager(bench, abstract)
    bench.sim()
    bench.conf()
    daemon = bench.sonard(env=manager.env)
    manager.heard("READY=1")
    Client(bench.socket_path).call("version")  # at once: ready means ready
    manager.heard("STATUS=1 sonar, data: ok")
    check(manager.feeds_in(1.0) == 0, "a watchdog is fed that nobody asked for")
    check(daemon.stop() == 0, "the end")
    manager.heard("STOPPING=1")


def fed(bench, threads):
    """Fed in time, also where no sonar says anything."""
    manager = Manager(bench)
    bench.conf(pipeline={"threads": threads})  # its port is not there
    bench.sonard(env=dict(manager.env, WATCHDOG_USEC="1000000"))
    manager.heard("READY=1")
    feeds = manager.feeds_in(5)
    check(feeds >= 5, "only %d feeds in 5 s of a watchdog of 1 s" % feeds)
    manager.heard("STATUS=1 sonar, data: no data from the sonar")


def not_ours(bench):
    manager = Manager(bench)
    bench.conf()
    bench.sonard(env=dict(manager.env, WATCHDOG_USEC="400000", WATCHDOG_PID="1"))
    manager.heard("READY=1")
    check(manager.feeds_in(1.0) == 0, "a watchdog is fed that is another process's")


def hung(bench, threads):
    """A thread that hangs ends the feed; when it goes on, so does the feed. The loop alone goes on all the while."""
    if SANITIZER:
        raise Skipped("a sanitizer needs to be loaded first")
    manager = Manager(bench)
    bench.sim()
    bench.conf(pipeline={"threads": threads})
    daemon = bench.sonard(env=dict(manager.env, WATCHDOG_USEC="2000000", LD_PRELOAD=helper("upset.so"),
                                   UPSET_THREADS=bench.path("hang")))
    client = daemon.client()
    pings_until(client, 20)
    manager.heard("WATCHDOG=1")
    bench.write("hang", "")
    until(lambda: "made no progress" in daemon.log(), "the log to tell of it")
    check(manager.feeds_in(3) == 0, "fed while a thread hangs")
    check(client.call("version"), "the loop answers")
    check(daemon.log().count("made no progress") == 1, "told again and again")
    os.remove(bench.path("hang"))
    until(lambda: manager.feeds_in(1), "the feed to go on")


def stopped_loop(bench):
    """SIGSTOP stops the loop and with it the feed."""
    manager = Manager(bench)
    bench.conf()
    daemon = bench.sonard(env=dict(manager.env, WATCHDOG_USEC="1000000"))
    manager.heard("WATCHDOG=1")
    os.kill(daemon.pid, signal.SIGSTOP)
    time.sleep(0.3)
    feeds = manager.feeds_in(2)
    os.kill(daemon.pid, signal.SIGCONT)
    check(feeds == 0, "fed while it stands")
    manager.heard("WATCHDOG=1")


def handed_over(bench):
    """A socket of the manager's: used, and left where it is; clients that came before the daemon are answered."""
    conf = bench.conf(server={"socket": bench.path("unused")})
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(bench.socket_path)
    listener.listen(8)
    early = Client(bench.socket_path)
    early.send(b'{"jsonrpc":"2.0","id":1,"method":"version"}\n')
    for _ in range(2):  # the second start finds the same socket
        daemon = activated(bench, listener.fileno(), 1, "-c", conf)
        try:
            check(Client(bench.socket_path).call("version"), "no answer on the socket handed over")
            check(not os.path.exists(bench.path("unused")), "it made a socket of its own beside")
        finally:
            daemon.send_signal(signal.SIGTERM)
        check(daemon.wait(20 * PATIENCE) == 0, "the end")
        check(os.path.exists(bench.socket_path), "it removed the manager's socket")
    check(early.reply()["id"] == 1, "the client that came first was not answered")


def activated(bench, fd, count, *arguments, env=None):
    """A daemon that has descriptor `fd` as its 3, and is told of `count`."""
    script = 'exec 3<&%d; export LISTEN_PID=$$ LISTEN_FDS=%d; exec "$0" "$@"' % (fd, count)
    log = open(bench.path("activated.log"), "ab")
    return subprocess.Popen(["bash", "-c", script, os.path.join(BUILD, "sonard")] + list(arguments), pass_fds=[fd],
                            stderr=log, env=dict(os.environ, **(env or {})))


def handed_nonsense(bench):
    conf = bench.conf()
    left, right = socket.socketpair()
    for what, fd, count in (("not a listening UNIX stream socket", left.fileno(), 1),
                            ("expected one ListenStream", left.fileno(), 2)):
        daemon = activated(bench, fd, count, "-c", conf)
        check(daemon.wait(20 * PATIENCE) == 1, "started with nonsense")
        with open(bench.path("activated.log"), encoding="utf-8") as log:
            check(what in log.read(), "the log does not say: " + what)
    right.close()


def jumped_back(bench):
    """A capture that is played anew: to the manager the service went on, and its socket still answers."""
    manager = Manager(bench)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(bench.socket_path)
    listener.listen(8)
    daemon = activated(bench, listener.fileno(), 1, "--replay", "tests/replay/box.mcap", "--stay", env=manager.env)
    try:
        for _ in range(3):
            client = Client(bench.socket_path)
            until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the capture")
            client.call("replay", to_s=1, pause="yes")
            while client.line() is not None:  # until the daemon closes it
                pass
            check(Client(bench.socket_path).call("status")["mode"] == "replay", "it has not gone back")
            Client(bench.socket_path).call("replay", to_s=1000)
        check("STOPPING=1" not in manager.listen(), manager.listen())
    finally:
        daemon.send_signal(signal.SIGTERM)
    check(daemon.wait(20 * PATIENCE) == 0, "the end")
    manager.heard("STOPPING=1")


def second(bench):
    """A second instance on the same socket refuses to start, disturbs nobody and leaves no capture; a dead one's socket
    is replaced."""
    captures = bench.path("captures")
    os.mkdir(captures)
    bench.conf(record={"directory": captures})
    first = bench.sonard()
    client = first.client()
    until(lambda: os.listdir(captures), "a capture")
    own = os.listdir(captures)
    other = bench.sonard()
    other.expected = 1
    check(other.wait() == 1, "a second sonard started")
    check("another sonard is listening on %s" % bench.socket_path in other.log(), "it does not say why: " + other.log())
    check(client.call("version"), "the first one was disturbed")
    check(os.listdir(captures) == own, "captures of it: %s" % os.listdir(captures))
    first.process.kill()
    first.expected = -signal.SIGKILL
    first.wait()
    check(os.path.exists(bench.socket_path), "there is no stale socket to replace")
    check(bench.sonard().client().call("version"), "a stale socket was not replaced")


def priorities(bench):
    """<N> before every line for the journal, and for nobody else who has inherited its variable."""
    bench.conf()
    log = os.stat(bench.write("sonard0.log", ""))  # where standard error of the first goes
    ours = bench.sonard(env={"JOURNAL_STREAM": "%d:%d" % (log.st_dev, log.st_ino), "SONARD_JOURNAL": bench.path("nobody")})
    ours.client()
    until(lambda: "version" in ours.log(), "a line of the log")
    check(all(line.startswith(("<3>", "<4>", "<5>", "<6>", "<7>")) for line in ours.log().splitlines()), ours.log())
    check("<5>version" in ours.log(), "the start is no notice: " + ours.log())
    ours.stop()
    other = bench.sonard(env={"JOURNAL_STREAM": "1:1"})
    other.client()
    until(lambda: "sonard: notice: version" in other.log(), "a line in words")


def journal(bench):
    """Entries with fields at the journal's socket; what many clients trigger is suppressed and counted."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    listener.bind(bench.path("journal"))
    entries = []

    def said(**fields):
        while select.select([listener], [], [], 0)[0]:
            lines = listener.recv(65536).decode().splitlines()
            entries.append(dict(line.split("=", 1) for line in lines))
        return [e for e in entries if all(e.get(k) == v for k, v in fields.items())]

    bench.sim()
    bench.conf()
    log = os.stat(bench.write("sonard1.log", ""))
    daemon = bench.sonard(env={"JOURNAL_STREAM": "%d:%d" % (log.st_dev, log.st_ino), "SONARD_JOURNAL": bench.path("journal")})
    until(lambda: said(SONARD_EVENT="started", PRIORITY="5", SYSLOG_IDENTIFIER="sonard"), "the start in the journal")
    opened = until(lambda: said(SONARD_EVENT="port_open"), "the port in the journal")[0]
    check(opened["MESSAGE"].startswith(opened["SONARD_SONAR"] + ": "), "no sonar in %s" % opened)
    check(opened["CODE_FILE"] == "daemon/input/input_port.c" and int(opened["CODE_LINE"]) > 0 and opened["CODE_FUNC"], opened)
    for _ in range(30):
        client = Client(bench.socket_path)
        try:
            client.send(b"x" * 70000)  # a line that is too long
            client.line()
        except OSError:
            pass
        client.close()
    until(lambda: said(SONARD_EVENT="client_cut", SONARD_COUNT="25"), "the number of suppressed lines", 30)
    check(len(said(SONARD_EVENT="client_cut")) == 6, "%d lines of one kind" % len(said(SONARD_EVENT="client_cut")))
    check(daemon.stop() == 0 and not daemon.log(), "lines beside the journal: " + daemon.log())


def stop(bench):
    """With a moving head, a recording, a map and 60 clients that watch, some of them without reading."""
    bench.sim()
    bench.conf(map={"voxel": "0.2 m", "directory": bench.path("maps")}, record={"directory": bench.path("captures")},
               pipeline={"threads": 2})
    os.mkdir(bench.path("captures"))
    daemon = bench.sonard()
    clients = [daemon.client() for _ in range(60)]
    for client in clients:
        client.call("watch", method="sectors", rate_hz=50)
    clients[0].call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 5])
    pings_until(clients[0], 50)
    begin = time.monotonic()
    status = daemon.stop()
    took = time.monotonic() - begin
    note("stopped in %.2f s" % took)
    check(status == 0, "the end")
    check(SANITIZER or took < 2, "the stop took %.2f s" % took)  # the promise is one; a busy machine needs more
    check(not os.path.exists(bench.socket_path), "the socket file is still there")


run([
    ("service_ready", lambda bench: ready(bench, False)),
    ("service_ready_abstract", lambda bench: ready(bench, True)),
    ("service_fed_0", lambda bench: fed(bench, 0)),
    ("service_fed_2", lambda bench: fed(bench, 2)),
    ("service_watchdog_not_ours", not_ours),
    ("service_hung_1", lambda bench: hung(bench, 1)),
    ("service_hung_2", lambda bench: hung(bench, 2)),
    ("service_stopped_loop", stopped_loop),
    ("service_socket_handed_over", handed_over),
    ("service_socket_nonsense", handed_nonsense),
    ("service_jumped_back", jumped_back),
    ("service_second_instance", second),
    ("service_priorities", priorities),
    ("service_journal", journal),
    ("service_stop", stop),
], parallel=2, gate=("service_socket_handed_over", "service_socket_nonsense", "service_second_instance", "service_priorities"))
