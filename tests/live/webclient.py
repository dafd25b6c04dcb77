# SPDX-License-Identifier: MIT
"""webclient - sonard-web in a bench, and just enough of HTTP and WebSocket to talk to it: written out by hand, so that
what no library would send can be sent, too."""
import base64
import json
import os
import socket
import struct
import time

from lib import BUILD, PATIENCE, Process, Skipped, check, free_port, until

SONARD_WEB = os.path.join(BUILD, "sonard-web")


class Web(Process):
    """sonard-web on a port of its own."""

    def __init__(self, bench, *arguments, port=None, socket=None):
        if not os.path.exists(SONARD_WEB):
            raise Skipped("sonard-web is not built: libwebsockets is not there")
        self.port = port or free_port()
        full = [SONARD_WEB, "--socket", socket or bench.socket_path, "--listen", "127.0.0.1:%d" % self.port] + list(arguments)
        super().__init__(bench, "web%d" % len(bench.processes), full)
        bench.processes.append(self)

        def up():
            check(self.status is None, "sonard-web ended: " + self.log())
            try:
                self.raw().close()
                return True
            except ConnectionRefusedError:
                return False
        until(up, "sonard-web's port")

    def raw(self):
        s = socket.create_connection(("127.0.0.1", self.port), 20 * PATIENCE)
        s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return s

    def request(self, path, method="GET", headers=(), host=None, body=b""):
        """(status, headers with small names, body) of one request on a connection of its own."""
        head = ["%s %s HTTP/1.1" % (method, path), "Host: %s" % (host or "127.0.0.1:%d" % self.port), "Connection: close"]
        head += list(headers) + (["Content-Length: %d" % len(body)] if body else [])
        with self.raw() as s:
            s.sendall(("\r\n".join(head) + "\r\n\r\n").encode("latin-1") + body)
            return read_answer(s)

    def get(self, path, **params):
        query = "&".join("%s=%s" % (k, ",".join(map(str, v)) if isinstance(v, list) else v) for k, v in params.items())
        status, _, body = self.request(path + ("?" + query if query else ""), headers=["X-Sonard: 1"])
        return status, json.loads(body)

    def rss(self):
        with open("/proc/%d/status" % self.pid, encoding="ascii") as f:
            return next(int(line.split()[1]) for line in f if line.startswith("VmRSS:")) * 1024

    def cpu_s(self):
        with open("/proc/%d/stat" % self.pid, encoding="ascii") as f:
            fields = f.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def read_answer(s):
    data = b""
    while True:
        try:
            more = s.recv(65536)
        except ConnectionResetError:
            more = b""
        if not more:
            break
        data += more
    if not data:
        return None, {}, b""
    head, _, body = data.partition(b"\r\n\r\n")
    lines = head.decode("latin-1").split("\r\n")
    headers = {k.strip().lower(): v.strip() for k, v in (line.split(":", 1) for line in lines[1:])}
    return int(lines[0].split()[1]), headers, body


class Page:
    """A WebSocket of the sub-protocol "sonard"."""

    def __init__(self, web, protocol="sonard", headers=(), host=None, receive_buffer=None):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(20 * PATIENCE)
        self.socket.connect(("127.0.0.1", web.port))
        key = base64.b64encode(os.urandom(16)).decode()
        head = ["GET /live HTTP/1.1", "Host: %s" % (host or "127.0.0.1:%d" % web.port), "Upgrade: websocket",
                "Connection: Upgrade", "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: " + key,
                "Sec-WebSocket-Protocol: " + protocol] + list(headers)
        self.socket.sendall(("\r\n".join(head) + "\r\n\r\n").encode())
        self.held = b""
        self.status = None
        try:
            while b"\r\n\r\n" not in self.held:
                more = self.socket.recv(4096)
                if not more:
                    return
                self.held += more
        except ConnectionResetError:
            return
        answer, self.held = self.held.split(b"\r\n\r\n", 1)
        self.status = int(answer.split()[1])

    def close(self):
        self.socket.close()

    def frame(self, opcode, payload, final=True):
        mask = os.urandom(4)
        size = len(payload)
        head = bytes([(0x80 if final else 0) | opcode])
        head += bytes([0x80 | size]) if size < 126 else bytes([0x80 | 126]) + struct.pack(">H", size) if size < 65536 \
            else bytes([0x80 | 127]) + struct.pack(">Q", size)
        body = bytes(b ^ mask[i % 4] for i, b in enumerate(payload))
        self.socket.sendall(head + mask + body)

    def say(self, message):
        self.frame(1, json.dumps(message).encode())

    def watch(self, *methods):
        self.say({"watch": [{"method": m} if isinstance(m, str) else {"method": m[0], "params": m[1]} for m in methods]})

    def _read(self, n):
        while len(self.held) < n:
            try:
                more = self.socket.recv(65536)
            except ConnectionResetError:
                more = b""
            if not more:
                return None
            self.held += more
        out, self.held = self.held[:n], self.held[n:]
        return out

    def next(self):
        """The next message: parsed JSON, or bytes; None when the server has closed."""
        whole = b""
        while True:
            head = self._read(2)
            if head is None:
                return None
            opcode, size = head[0] & 15, head[1] & 127
            if size == 126:
                size = struct.unpack(">H", self._read(2))[0]
            elif size == 127:
                size = struct.unpack(">Q", self._read(8))[0]
            payload = self._read(size)
            if payload is None or opcode == 8:
                return None
            if opcode == 9:
                self.frame(10, payload)
                continue
            whole += payload
            first = opcode if opcode else first
            if head[0] & 0x80:
                return json.loads(whole) if first == 1 else whole

    def until(self, fits, what, limit_s=20.0):
        """The first message that fits."""
        end = time.monotonic() + limit_s * PATIENCE
        while True:
            check(time.monotonic() < end, "waited %g s in vain: %s" % (limit_s, what))
            message = self.next()
            check(message is not None, "closed while waiting: " + what)
            if fits(message):
                return message

    def of(self, method):
        return self.until(lambda m: isinstance(m, dict) and m.get("method") == method and ("result" in m or "error" in m), method)

    def ask(self, method, **params):
        self.say({"id": 7, "method": method, "params": params})
        return self.until(lambda m: isinstance(m, dict) and m.get("id") == 7, "the answer to " + method)


def rows_of(message):
    """What view_rows.h writes: (sensor, Unix time, rows)."""
    kind, name, n, t_unix = struct.unpack_from("<BBHd", message, 0)
    check(kind == 1, "another kind of message")
    at = 12 + name
    rows = []
    for _ in range(n):
        t, az, width, r0, r1, blind, near, state, echoes, bins = struct.unpack_from("<dffffffBBH", message, at)
        at += 36
        found = []
        for _ in range(echoes):
            found.append(struct.unpack_from("<fBB", message, at))
            at += 6
        rows.append({"t": t, "azimuth": az, "width": width, "r0": r0, "r1": r1, "blind": blind, "near": near,
                     "state": ("echo", "silent", "blind")[state], "echoes": found, "bins": message[at:at + bins]})
        at += bins
    check(at == len(message), "%d bytes are left" % (len(message) - at))
    return message[12:12 + name].decode(), t_unix, rows
