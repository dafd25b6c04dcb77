# SPDX-License-Identifier: MIT
"""sonard - ask a running sonar daemon which water is free. Python 3.9 and its standard library alone.

    with sonard.connect() as s:
        if s.blocked(0, distance_m=5).state == "clear":
            ...
        for sectors in s.watch("sectors", rate_hz=5, count=36):
            steer(sectors)

Methods, parameters and results are those of sonard-protocol(7): SI units, angles in degrees. Every method of the daemon is
one of the client, s.nearest(distance_m=10), and gives the result as it is, a dict whose keys sonard.results names; blocked,
sectors, limit and time_to_collision give a Blocked, Sectors, a Limit and a Collision, asked or watched. A number that the
daemon does not know is None. Nothing here has a thread; a Client belongs to one thread at a time. sonard.aio has the same
for asyncio.
"""
from __future__ import annotations

import json
import os
import select
import socket
import stat
import time
from typing import Any, Dict, Iterator, Optional

from . import results
from ._answers import (TYPES, Blocked, Collision, Error, Limit, Lost, NoDaemon, NoPermission, Refused, Sector, Silent,
                       given,
                       instead_of, refused)
from ._methods import Methods

__all__ = ["connect", "Client", "Watch", "Blocked", "Sector", "Limit", "Collision", "Error", "NoDaemon", "NoPermission",
           "Silent", "Lost", "Refused", "DEFAULT_SOCKET", "results"]

DEFAULT_SOCKET = "/run/sonard/sonard.sock"
_LINE_MAX = 8 << 20
_RETRY_S = 0.02


def _is_no_socket(path: str) -> bool:
    """What is refused there need not be one: the kernel says the same of a file."""
    try:
        return not stat.S_ISSOCK(os.stat(path).st_mode)
    except OSError:
        return False


def connect(path: Optional[str] = None, timeout_s: float = 5.0) -> Client:
    """To the socket at path, else $SONARD_SOCKET, else DEFAULT_SOCKET; timeout_s holds for every call."""
    return Client(path, timeout_s)


class Client(Methods):
    """A connection to the daemon."""

    def __init__(self, path: Optional[str] = None, timeout_s: float = 5.0):
        self.socket_path = path or os.environ.get("SONARD_SOCKET") or DEFAULT_SOCKET
        self.timeout_s = timeout_s
        self._held = bytearray()
        self._last_id = 0
        self._kept: Dict[int, Optional[Dict[str, Any]]] = {}  # of each watch: what it said last, if nobody has read that
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(timeout_s)
        try:
            self._connect(time.monotonic() + timeout_s)
        except Error:
            self._socket.close()
            raise

    def _connect(self, deadline_s: float) -> None:
        while True:
            try:
                return self._socket.connect(self.socket_path)
            except PermissionError:
                raise NoPermission("no permission to use %s: is this user in the socket's group?" % self.socket_path) from None
            except (socket.timeout, BlockingIOError):  # its queue of new clients is full
                if time.monotonic() >= deadline_s:
                    raise Silent("the daemon on %s does not take new clients" % self.socket_path) from None
                time.sleep(_RETRY_S)
            except OSError as fault:
                if isinstance(fault, ConnectionRefusedError) and _is_no_socket(self.socket_path):
                    raise NoDaemon("%s is not a socket" % self.socket_path) from None
                raise NoDaemon("no daemon answers on %s (%s): is sonard running, with this socket?" % (self.socket_path, fault)) from None

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection and every watch."""
        self._socket.close()

    def fileno(self) -> int:
        """For select and its like: readable when a watch may have said something."""
        return self._socket.fileno()

    # ---- any method ----

    def call(self, method: str, /, **params: Any) -> Any:
        """The result of any method of the daemon. Raises Refused, Silent or Lost."""
        self._last_id += 1
        request = {"jsonrpc": "2.0", "id": self._last_id, "method": method, "params": params}
        deadline_s = time.monotonic() + self.timeout_s
        self._send(json.dumps(request, allow_nan=False).encode() + b"\n")
        while True:
            message = self._read(deadline_s)
            if "id" not in message:
                self._keep(message)
            elif message["id"] in (self._last_id, None):  # None: this client is refused as such
                if "error" in message:
                    raise refused(method, message["error"])
                if "result" not in message:
                    raise Lost("%s: a reply without a result" % method)
                return message["result"]

    def _ask(self, method: str, params: Dict[str, Any]) -> Any:
        result = self.call(method, **given(params))
        return TYPES[method](result) if method in TYPES else result

    def watch(self, method: str, rate_hz: float = 1.0, **params: Any) -> Watch:
        """Has the daemon ask a method by itself rate_hz times a second; iterate over what it gives for the results, of the
        type that the method of that name has here."""
        number = self.call("watch", method=method, params=params, rate_hz=rate_hz)["watch"]
        self._kept[number] = None
        return Watch(self, method, number, 1.0 / rate_hz)

    # ---- the socket ----

    def _send(self, data: bytes) -> None:
        try:
            self._socket.settimeout(self.timeout_s)
            self._socket.sendall(data)
        except socket.timeout:
            self.close()  # half a request is sent
            raise Lost("the daemon on %s does not read requests" % self.socket_path) from None
        except (BrokenPipeError, ConnectionResetError):
            pass  # it may have said why before: reading tells
        except OSError as fault:
            raise Lost("sending to %s: %s" % (self.socket_path, fault)) from None

    def _read(self, deadline_s: float) -> Dict[str, Any]:
        """The next message."""
        while b"\n" not in self._held:
            try:
                left_s = max(0.0, deadline_s - time.monotonic())
                if not select.select([self._socket], [], [], left_s)[0]:
                    raise Silent("the daemon on %s is silent" % self.socket_path)
                data = self._socket.recv(65536)
            except (OSError, ValueError) as fault:
                if isinstance(fault, Silent):
                    raise
                raise Lost("the daemon on %s ended the connection: %s" % (self.socket_path, fault)) from None
            if not data:
                raise Lost("the daemon on %s ended the connection" % self.socket_path)
            self._held += data
            if len(self._held) > _LINE_MAX:
                raise Lost("a reply of %s is longer than %d bytes" % (self.socket_path, _LINE_MAX))
        line, _, rest = self._held.partition(b"\n")
        self._held = rest
        try:
            message = json.loads(line)
        except ValueError:
            message = None
        if not isinstance(message, dict):
            raise Lost("the program listening on %s does not speak JSON-RPC" % self.socket_path)
        return message

    def _keep(self, message: Dict[str, Any]) -> None:
        params = message.get("params")
        if isinstance(params, dict) and params.get("watch") in self._kept:
            before = self._kept[params["watch"]]
            self._kept[params["watch"]] = params if before is None else instead_of(before, params)

    def _next(self, number: int, deadline_s: float) -> Dict[str, Any]:
        while True:
            said = self._kept[number]
            if said is not None and b"\n" not in self._held and not select.select([self._socket], [], [], 0)[0]:
                self._kept[number] = None
                return said
            message = self._read(deadline_s)
            if "id" not in message:
                self._keep(message)


class Watch:
    """The results of a method, again and again: iterate over it. Ends with stop(), with the block of a with statement, or
    with the client."""

    def __init__(self, client: Client, method: str, number: int, period_s: float):
        self.client, self.method, self.number, self.period_s = client, method, number, period_s
        self.skipped = 0  # answers left out so far, because they were not read in time

    def __enter__(self) -> Watch:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def __iter__(self) -> Iterator[Any]:
        return self

    def __next__(self) -> Any:
        if self.number not in self.client._kept:
            raise StopIteration
        return self.next()

    def next(self, timeout_s: Optional[float] = None) -> Any:
        """The newest result that was not given yet. Raises Silent when none came within timeout_s (that of the client beyond a period; 0: only what
        is there), Refused when the method fails; the watch goes on. The type is that of the
        method asked once."""
        if timeout_s is None:
            timeout_s = self.client.timeout_s + self.period_s
        said = self.client._next(self.number, time.monotonic() + timeout_s)
        self.skipped += said.get("skipped", 0)
        if "result" in said:
            return TYPES.get(self.method, lambda result: result)(said["result"])
        error = said.get("error", {})
        raise Refused(self.method, error.get("code", 0), error.get("message", "no result"))

    def stop(self) -> None:
        """Ends the watch; what it has said and nobody has read is gone."""
        if self.client._kept.pop(self.number, None) is not None and self.client.fileno() >= 0:
            self.client.call("unwatch", watch=self.number)
