# SPDX-License-Identifier: MIT
"""sonard.aio - the same for asyncio: every method of the daemon is a coroutine of the client, and many may wait at a time.

    async with await sonard.aio.connect() as s:
        if (await s.blocked(0, distance_m=5)).state == "clear":
            ...
        async for sectors in await s.watch("sectors", rate_hz=5, count=36):
            steer(sectors)
"""
from __future__ import annotations

import asyncio
import json
import os
from typing import Any, AsyncIterator, Dict, Optional, Tuple

from . import DEFAULT_SOCKET, _LINE_MAX, _RETRY_S
from ._answers import TYPES, Error, Lost, NoDaemon, NoPermission, Refused, Silent, given, instead_of, refused
from ._methods import AsyncMethods

__all__ = ["connect", "Client", "Watch"]


async def connect(path: Optional[str] = None, timeout_s: float = 5.0) -> Client:
    """To the socket at path, else $SONARD_SOCKET, else DEFAULT_SOCKET; timeout_s holds for every call."""
    path = path or os.environ.get("SONARD_SOCKET") or DEFAULT_SOCKET
    try:
        reader, writer = await asyncio.wait_for(_open(path), timeout_s)
    except PermissionError:
        raise NoPermission("no permission to use %s: is this user in the socket's group?" % path) from None
    except asyncio.TimeoutError:
        raise Silent("the daemon on %s does not take new clients" % path) from None
    except OSError as fault:
        raise NoDaemon("no daemon answers on %s (%s): is sonard running, with this socket?" % (path, fault)) from None
    return Client(path, timeout_s, reader, writer)


async def _open(path: str) -> Tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """asyncio takes a socket whose queue of new clients is full for a connected one: only one with a peer is."""
    while True:
        reader, writer = await asyncio.open_unix_connection(path, limit=_LINE_MAX)
        try:
            writer.get_extra_info("socket").getpeername()
            return reader, writer
        except OSError:
            writer.close()
            await asyncio.sleep(_RETRY_S)


class Client(AsyncMethods):
    """A connection to the daemon, within one event loop."""

    def __init__(self, path: str, timeout_s: float, reader: asyncio.StreamReader, writer: asyncio.StreamWriter):
        self.socket_path, self.timeout_s = path, timeout_s
        self._reader, self._writer = reader, writer
        self._last_id = 0
        self._asked: Dict[int, asyncio.Future[Any]] = {}
        self._watched: Dict[int, asyncio.Queue[Dict[str, Any]]] = {}
        self._lost: Optional[Error] = None
        self._reading = asyncio.ensure_future(self._read())

    async def __aenter__(self) -> Client:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Ends the connection and every watch."""
        self._reading.cancel()
        self._fail(Lost("the connection was closed"))
        self._writer.close()

    async def call(self, method: str, /, **params: Any) -> Any:
        """The result of any method of the daemon. Raises Refused, Silent or Lost."""
        if self._lost:
            raise self._lost.with_traceback(None)  # else each raise adds to the one before
        self._last_id += 1
        number = self._last_id
        self._asked[number] = asyncio.get_running_loop().create_future()
        request = {"jsonrpc": "2.0", "id": number, "method": method, "params": params}
        try:
            self._writer.write(json.dumps(request, allow_nan=False).encode() + b"\n")
            reply = await asyncio.wait_for(self._asked[number], self.timeout_s)
        except asyncio.TimeoutError:
            raise Silent("the daemon on %s is silent" % self.socket_path) from None
        finally:
            del self._asked[number]
        if "error" in reply:
            raise refused(method, reply["error"])
        if "result" not in reply:
            raise Lost("%s: a reply without a result" % method)
        return reply["result"]

    async def _ask(self, method: str, params: Dict[str, Any]) -> Any:
        result = await self.call(method, **given(params))
        return TYPES[method](result) if method in TYPES else result

    async def watch(self, method: str, rate_hz: float = 1.0, **params: Any) -> Watch:
        """Has the daemon ask a method by itself rate_hz times a second; iterate over what it gives for the results, of the
        type that the method of that name has here."""
        number = (await self.call("watch", method=method, params=params, rate_hz=rate_hz))["watch"]
        return Watch(self, method, number, self._queue(number))

    def _queue(self, number: int) -> asyncio.Queue[Dict[str, Any]]:
        return self._watched.setdefault(number, asyncio.Queue())

    async def _read(self) -> None:
        """The only one who reads: everything goes to who waits for it."""
        try:
            while True:
                line = await self._reader.readline()
                if not line:
                    raise Lost("the daemon on %s ended the connection" % self.socket_path)
                self._take(json.loads(line))
        except Error as fault:
            self._fail(fault)
        except (OSError, ValueError, LookupError, AttributeError, TypeError, RecursionError) as fault:
            self._fail(Lost("the program listening on %s does not speak JSON-RPC: %s" % (self.socket_path, fault)))

    def _take(self, message: Dict[str, Any]) -> None:
        if "id" not in message:
            queue = self._queue(message["params"]["watch"])
            said = message["params"]
            queue.put_nowait(said if queue.empty() else instead_of(queue.get_nowait(), said))
        elif message["id"] is None:
            error = message.get("error", {})  # this client is refused as such
            raise Refused("the connection", error.get("code", 0), error.get("message", "an error without a message"))
        elif message["id"] in self._asked and not self._asked[message["id"]].done():
            self._asked[message["id"]].set_result(message)

    def _fail(self, fault: Error) -> None:
        self._lost = self._lost or fault
        for asked in self._asked.values():
            if not asked.done():
                asked.set_exception(self._lost)
        for queue in self._watched.values():
            queue.put_nowait({})


class Watch:
    """The newest results of a method, again and again: iterate over it. Ends with stop() or with the client."""

    def __init__(self, client: Client, method: str, number: int, queue: asyncio.Queue[Dict[str, Any]]):
        self.client, self.method, self.number = client, method, number
        self.skipped = 0  # answers left out so far, because they were not read in time
        self._queue = queue

    def __aiter__(self) -> AsyncIterator[Any]:
        return self

    async def __anext__(self) -> Any:
        if self.number not in self.client._watched:
            raise StopAsyncIteration
        said = await self._queue.get()
        if not said:  # the watch or the connection has ended; whoever else waits is to learn of it, too
            self._queue.put_nowait(said)
            if self.number not in self.client._watched:
                raise StopAsyncIteration
            raise self.client._lost or Lost("the connection was closed")
        self.skipped += said.get("skipped", 0)
        if "result" in said:
            return TYPES.get(self.method, lambda result: result)(said["result"])
        error = said.get("error", {})
        raise Refused(self.method, error.get("code", 0), error.get("message", "no result"))

    async def stop(self) -> None:
        """Ends the watch; what it has said and nobody has read is gone."""
        try:
            if self.number in self.client._watched and not self.client._lost:
                await self.client.call("unwatch", watch=self.number)
        finally:
            self.client._watched.pop(self.number, None)
            self._queue.put_nowait({})
