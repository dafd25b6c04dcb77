#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""test_tcp - sonars and NMEA 0183 behind serial device servers, which speak TCP."""
import os
import select
import socket
import sys
import threading
import tty

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from lib import SONARD, check, run, until  # noqa: E402


class DeviceServer(threading.Thread):
    """One serial line for one connection at a time, as a converter has it."""

    def __init__(self, terminal=None):
        super().__init__(daemon=True)
        self.line = os.open(terminal, os.O_RDWR | os.O_NOCTTY) if terminal else None
        if terminal:
            tty.setraw(self.line)
        self.listener = socket.socket()
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.listener.bind(("127.0.0.1", 0))
        self.listener.listen(1)
        self.address = self.listener.getsockname()
        self.client, self.connections, self.ended = None, 0, False
        self.start()

    def run(self):
        while not self.ended:
            ends = [end for end in (self.listener, self.client, self.line) if end is not None]
            ready = select.select(ends, [], [], 0.05)[0]
            if self.listener in ready:
                self.client = self.listener.accept()[0]
                self.connections += 1
                continue
            if self.client in ready:
                self._from_client()
            if self.line in ready:
                self.say(os.read(self.line, 4096))

    def _from_client(self):
        try:
            data = self.client.recv(4096)
        except OSError:
            data = b""
        if not data:
            self.client.close()
            self.client = None
        elif self.line is not None:
            os.write(self.line, data)

    def say(self, data):
        client = self.client
        if client is not None:
            try:
                client.sendall(data)
            except OSError:
                pass

    def hang_up(self):
        client = self.client
        if client is not None:
            client.shutdown(socket.SHUT_RDWR)

    def stop(self):
        self.ended = True
        self.join()


def sensor(client):
    return client.call("status")["sensors"][0]


def pings(client, n):
    first = sensor(client)["pings"]
    until(lambda: sensor(client)["pings"] >= first + n, "%d pings" % n)


def head(bench, program, arguments, host="127.0.0.1", **keys):
    sim = bench.twin(program, "--link", bench.path("line"), *arguments)
    server = DeviceServer(sim.address)
    bench.conf(sonar=dict(keys, port="tcp:%s:%d" % (host, server.address[1])))
    daemon = bench.sonard()
    return server, daemon, daemon.client()


def ping360(bench):
    """It pings, and again after the server has hung up."""
    server, daemon, client = head(bench, "ping360_sim", ("--scene", "box"), device="ping360", range="5 m")
    pings(client, 20)
    server.hang_up()
    until(lambda: server.connections == 2, "another connection")
    pings(client, 20)
    check(sensor(client)["reconnects"] == 1, sensor(client))
    check("lost: hung up" in daemon.log(), daemon.log())
    server.stop()


def micron(bench):
    server, _, client = head(bench, "micron_sim", (), device="micron", range="10 m")
    pings(client, 20)
    server.stop()


def named(bench):
    """The name is looked up."""
    server, _, client = head(bench, "ping360_sim", ("--scene", "box"), host="localhost", device="ping360", range="5 m")
    pings(client, 5)
    server.stop()


def instrument(bench):
    server = DeviceServer()
    bench.conf(nmea={"port": "tcp:127.0.0.1:%d" % server.address[1]})
    client = bench.sonard().client()
    until(lambda: server.connections == 1, "a connection")

    def heard():
        server.say(b"$GPHDT,90.0,T*0C\r\n")
        return client.call("status")["nmea"]["sentences"] > 0
    until(heard, "a sentence")
    server.stop()


def refused(bench):
    for port, says in (("tcp:127.0.0.1:4001:115200", "the baud rate is set in the device server"),
                       ("tcp:127.0.0.1", "must be a host and a port number")):
        bench.conf(sonar={"device": "ping360", "port": port})
        result = bench.run(SONARD, "--check", bench.path("sonard.conf"))
        check(result.returncode == 1 and says in result.stderr + result.stdout, result)


def nobody(bench):
    """A server that is not there yet is told once, and waited for."""
    holder = socket.socket()
    holder.bind(("127.0.0.1", 0))
    bench.conf(sonar={"device": "ping360", "port": "tcp:127.0.0.1:%d" % holder.getsockname()[1]})
    daemon = bench.sonard()
    client = daemon.client()
    until(lambda: "cannot connect: Connection refused" in daemon.log(), "a line in the log")
    holder.listen(1)
    until(lambda: sensor(client)["state"] != "no port", "a connection")
    check(daemon.log().count("cannot connect") == 1, daemon.log())
    holder.close()


cases = [("tcp_" + case.__name__, case) for case in (ping360, micron, named, instrument, refused, nobody)]
run(cases, parallel=3, gate=("tcp_ping360", "tcp_micron", "tcp_instrument", "tcp_refused", "tcp_nobody"))
