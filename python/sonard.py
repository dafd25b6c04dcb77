# SPDX-License-Identifier: MIT
"""sonard - ask a running sonar daemon which water is free. One file, Python 3.9 and its standard library alone.

    with sonard.connect() as s:
        if s.blocked(0, distance_m=5).state == "clear":
            ...
        for sectors in s.watch("sectors", rate_hz=5, count=36):
            steer(sectors)

Methods, parameters and results are those of sonard-protocol(7): SI units, angles in degrees. Every method of the daemon can be
called by its name, s.nearest(distance_m=10), and gives the result as it is, a dict; those with a method of their own here
give a typed answer, asked or watched. A number that the daemon does not know is None. Nothing here has a thread; a Client belongs to one
thread at a time.
"""
from __future__ import annotations

import collections
import dataclasses
import functools
import json
import os
import select
import socket
import stat
import time
from typing import Any, Callable, Deque, Dict, Iterator, List, Optional, Sequence

__all__ = ["connect", "Client", "Watch", "Blocked", "Sector", "Limit", "Collision", "Error", "NoDaemon", "NoPermission",
           "Silent", "Lost", "Refused", "DEFAULT_SOCKET"]

DEFAULT_SOCKET = "/run/sonard/sonard.sock"
_LINE_MAX = 8 << 20
_KEPT_MAX = 64
_RETRY_S = 0.02


class Error(Exception):
    """Of everything that goes wrong here."""


class NoDaemon(Error):
    """Nobody listens at the path."""


class NoPermission(Error):
    """The socket is there, this user may not use it."""


class Silent(Error, TimeoutError):
    """No answer within the timeout. The connection may be used again."""


class Lost(Error, ConnectionError):
    """The connection ended, or what came was no answer: make a new one."""


class Refused(Error):
    """The daemon answered with an error; code is that of JSON-RPC."""

    def __init__(self, method: str, code: int, message: str):
        super().__init__("%s: %s" % (method, message))
        self.code = code


@dataclasses.dataclass(frozen=True)
class Blocked:
    state: str  # "blocked", "clear" or "unknown"
    range_m: Optional[float]  # of the nearest obstacle; None unless blocked
    range_sd_m: Optional[float]
    confidence: float
    free_to_m: float  # the water is known to be free up to here
    blind_to_m: float  # nothing is known nearer than this
    age_s: Optional[float]  # of the oldest evidence that counts; None: there is none
    reason: str
    target: str  # the weakest obstacle that free water is without; a weaker one may be there
    bottom_db: Optional[float]  # the softest bottom likewise, in dB below a wall; None: soft bottoms may be there


@dataclasses.dataclass(frozen=True)
class Sector:
    azimuth_deg: float  # of its middle
    width_deg: float
    state: str
    range_m: Optional[float]  # of the nearest obstacle, at any distance; None: none
    free_to_m: float
    blind_to_m: float  # nothing is known nearer than this: free and clear are so from here on
    age_s: Optional[float]


@dataclasses.dataclass(frozen=True)
class Limit:
    velocity_mps: List[float]  # that may be flown, in the axes of the one asked for
    speed_mps: float
    asked_mps: float
    limited_by: str  # "nothing", "blocked" or "unknown"
    azimuth_deg: Optional[float]  # of what limits; None: nothing does, or in no direction of its own
    elevation_deg: Optional[float]
    stop_m: float
    uncertain_m: float  # beside it: the vehicle may be so far from where it is taken to be
    blocked_m: Optional[float]
    free_m: float
    age_s: Optional[float]
    reason: str
    remedy: str  # what would lift it
    target: str  # the weakest obstacle that free water is without; a weaker one may be there
    bottom_db: Optional[float]  # the softest bottom likewise, in dB below a wall; None: soft bottoms may be there


@dataclasses.dataclass(frozen=True)
class Collision:
    state: str
    time_s: Optional[float]  # None unless blocked
    time_sd_s: Optional[float]
    distance_m: Optional[float]
    confidence: Optional[float]
    unknown_after_s: Optional[float]  # the corridor is unknown from then on; None: it is not
    speed_mps: float
    ahead_s: float
    age_s: Optional[float]
    reason: str
    target: str  # the weakest obstacle that free water is without; a weaker one may be there
    bottom_db: Optional[float]  # the softest bottom likewise, in dB below a wall; None: soft bottoms may be there


def _typed(kind: Any, result: Any) -> Any:
    """The fields that this file knows; a daemon that is newer may say more, one that says less gave no answer."""
    try:
        return kind(**{field.name: result[field.name] for field in dataclasses.fields(kind)})
    except (KeyError, TypeError) as fault:
        raise Lost("the answer is not one that this module knows: %s" % fault) from None


def _sectors(result: Any) -> List[Sector]:
    if not isinstance(result, dict) or not isinstance(result.get("sectors"), list):
        raise Lost("the answer is not one that this module knows: no sectors")
    return [_typed(Sector, sector) for sector in result["sectors"]]


# What the result of these methods becomes.
_TYPES: Dict[str, Callable[[Any], Any]] = {
    "blocked": functools.partial(_typed, Blocked),
    "sectors": _sectors,
    "limit": functools.partial(_typed, Limit),
    "time_to_collision": functools.partial(_typed, Collision),
}


def _is_no_socket(path: str) -> bool:
    """What is refused there need not be one: the kernel says the same of a file."""
    try:
        return not stat.S_ISSOCK(os.stat(path).st_mode)
    except OSError:
        return False


def connect(path: Optional[str] = None, timeout_s: float = 5.0) -> Client:
    """To the socket at path, else $SONARD_SOCKET, else DEFAULT_SOCKET; timeout_s holds for every call."""
    return Client(path, timeout_s)


class Client:
    """A connection to the daemon."""

    def __init__(self, path: Optional[str] = None, timeout_s: float = 5.0):
        self.path = path or os.environ.get("SONARD_SOCKET") or DEFAULT_SOCKET
        self.timeout_s = timeout_s
        self._held = bytearray()
        self._last_id = 0
        self._kept: Dict[int, Deque[Dict[str, Any]]] = {}  # of each watch: what it said and nobody has read
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
                return self._socket.connect(self.path)
            except PermissionError:
                raise NoPermission("no permission to use %s: is this user in the socket's group?" % self.path) from None
            except (socket.timeout, BlockingIOError):  # its queue of new clients is full
                if time.monotonic() >= deadline_s:
                    raise Silent("the daemon on %s does not take new clients" % self.path) from None
                time.sleep(_RETRY_S)
            except OSError as fault:
                if isinstance(fault, ConnectionRefusedError) and _is_no_socket(self.path):
                    raise NoDaemon("%s is not a socket" % self.path) from None
                raise NoDaemon("no daemon answers on %s (%s): is sonard running, with this socket?" % (self.path, fault)) from None

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
                    error = message["error"]
                    raise Refused(method, error.get("code", 0), error.get("message", "an error without a message"))
                if "result" not in message:
                    raise Lost("%s: a reply without a result" % method)
                return message["result"]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda **params: self.call(name, **params)

    def watch(self, method: str, rate_hz: float = 1.0, **params: Any) -> Watch:
        """Has the daemon ask a method by itself rate_hz times a second; iterate over what it gives for the results, of the
        type that the method of that name has here."""
        number = self.call("watch", method=method, params=params, rate_hz=rate_hz)["watch"]
        self._kept[number] = collections.deque(maxlen=_KEPT_MAX)
        return Watch(self, method, number, 1.0 / rate_hz)

    # ---- what an autopilot asks ----

    def _ask(self, method: str, **params: Any) -> Any:
        return _TYPES[method](self.call(method, **params))

    def blocked(self, azimuth_deg: float, distance_m: float, **params: Any) -> Blocked:
        """Is the water free so far in this direction? More parameters: elevation_deg, half_angle_deg or radius_m, frame, grid."""
        return self._ask("blocked", azimuth_deg=azimuth_deg, distance_m=distance_m, **params)

    def sectors(self, **params: Any) -> List[Sector]:
        """The state all around: count, elevation_deg, distance_m, frame, grid."""
        return self._ask("sectors", **params)

    def limit(self, velocity_mps: Sequence[float], **params: Any) -> Limit:
        """The velocity made so short that the vehicle can still stop in water known to be free: frame."""
        return self._ask("limit", velocity_mps=list(velocity_mps), **params)

    def time_to_collision(self, **params: Any) -> Collision:
        """When the vehicle meets something: velocity_mps (that of the pose), frame, ahead_s."""
        return self._ask("time_to_collision", **params)

    def pose(self, **parts: Any) -> None:
        """Tells where the vehicle is: attitude_deg or quaternion, position_m, depth_m, velocity_mps, altitude_m, t_unix."""
        self.call("pose", **parts)

    def pose_withdraw(self) -> None:
        """Takes all poses back: the daemon goes on as if none had ever been given."""
        self.call("pose_withdraw")

    # ---- the socket ----

    def _send(self, data: bytes) -> None:
        try:
            self._socket.settimeout(self.timeout_s)
            self._socket.sendall(data)
        except socket.timeout:
            self.close()  # half a request is sent
            raise Lost("the daemon on %s does not read requests" % self.path) from None
        except (BrokenPipeError, ConnectionResetError):
            pass  # it may have said why before: reading tells
        except OSError as fault:
            raise Lost("sending to %s: %s" % (self.path, fault)) from None

    def _read(self, deadline_s: float) -> Dict[str, Any]:
        """The next message."""
        while b"\n" not in self._held:
            try:
                left_s = max(0.0, deadline_s - time.monotonic())
                if not select.select([self._socket], [], [], left_s)[0]:
                    raise Silent("the daemon on %s is silent" % self.path)
                data = self._socket.recv(65536)
            except (OSError, ValueError) as fault:
                if isinstance(fault, Silent):
                    raise
                raise Lost("the daemon on %s ended the connection: %s" % (self.path, fault)) from None
            if not data:
                raise Lost("the daemon on %s ended the connection" % self.path)
            self._held += data
            if len(self._held) > _LINE_MAX:
                raise Lost("a reply of %s is longer than %d bytes" % (self.path, _LINE_MAX))
        line, _, rest = self._held.partition(b"\n")
        self._held = rest
        try:
            message = json.loads(line)
        except ValueError:
            message = None
        if not isinstance(message, dict):
            raise Lost("the program listening on %s does not speak JSON-RPC" % self.path)
        return message

    def _keep(self, message: Dict[str, Any]) -> None:
        params = message.get("params")
        if isinstance(params, dict) and params.get("watch") in self._kept:
            self._kept[params["watch"]].append(params)

    def _next(self, number: int, deadline_s: float) -> Dict[str, Any]:
        while not self._kept[number]:
            message = self._read(deadline_s)
            if "id" not in message:
                self._keep(message)
        return self._kept[number].popleft()


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
        """The next result. Raises Silent when none came within timeout_s (that of the client beyond a period; 0: only what
        is there), Refused when the method fails; the watch goes on. The type is that of the
        method asked once."""
        if timeout_s is None:
            timeout_s = self.client.timeout_s + self.period_s
        said = self.client._next(self.number, time.monotonic() + timeout_s)
        self.skipped += said.get("skipped", 0)
        if "result" in said:
            return _TYPES.get(self.method, lambda result: result)(said["result"])
        error = said.get("error", {})
        raise Refused(self.method, error.get("code", 0), error.get("message", "no result"))

    def stop(self) -> None:
        """Ends the watch; what it has said and nobody has read is gone."""
        if self.client._kept.pop(self.number, None) is not None and self.client.fileno() >= 0:
            self.client.call("unwatch", watch=self.number)
