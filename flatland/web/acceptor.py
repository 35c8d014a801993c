"""Accepts connections so that idle clients cannot keep others from connecting.

asyncio accepts any number of connections, gives a client any time for its first request, and starts
to accept several times over once the process has no file descriptors left.
"""

from __future__ import annotations

import asyncio
import socket
from typing import Any, Final

from aiohttp import web

from flatland.runtime.client_limits import (
    ACCEPTED_AT_ONCE,
    EXHAUSTED,
    EXHAUSTED_PERIOD,
    LimitedLog,
    connection_limit,
)

MAX_CONNECTIONS: Final = 256
"""Largest number of connections, but at most a quarter of the files that the process may open."""
MAX_OF_ADDRESS: Final = 128
"""Largest number of connections of an address, which may be that of a proxy."""
HEADER_TIMEOUT: Final = 5.0
"""Time from the connection of a client to the end of the header of its first request [s]."""

_Peer = tuple[Any, ...]  # host, port and, for IPv6, more


class Acceptor:
    """Accepts the connections of a server; all methods are called in the thread of the loop."""

    def __init__(self, listener: socket.socket) -> None:
        """Creates an object that accepts nothing yet.

        Args:
            listener: Socket that listens; closed by `close`.
        """
        self._listener = listener
        self._loop = asyncio.get_running_loop()
        # Connections without a request, the oldest first, and when each is closed.
        self._silent: dict[asyncio.Transport, asyncio.TimerHandle] = {}
        self._starting: dict[asyncio.Task[None], _Peer] = {}
        self._log = LimitedLog()
        self._closed = False

    def start(self, server: web.Server) -> None:
        """Starts to accept connections.

        Args:
            server: Serves them.
        """
        self._server = server
        self._listener.setblocking(False)
        self._loop.add_reader(self._listener, self._accept)

    def close(self) -> None:
        """Accepts no further connections; those that exist remain."""
        self._closed = True
        self._loop.remove_reader(self._listener)
        self._listener.close()
        for timer in self._silent.values():
            timer.cancel()

    def received_request(self, transport: asyncio.Transport | None) -> None:
        """Ends the time limit of a connection."""
        timer = None if transport is None else self._silent.pop(transport, None)
        if timer is not None:
            timer.cancel()

    def _accept(self) -> None:
        for _ in range(ACCEPTED_AT_ONCE):
            try:
                connection, address = self._listener.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno in EXHAUSTED:
                    self._log.warn(f"web viewer: cannot accept a connection: {error}")
                    self._pause()
                return
            if not self._admits(address):
                connection.close()
                continue
            task = self._loop.create_task(self._serve(connection))
            self._starting[task] = address
            task.add_done_callback(self._starting.pop)

    def _admits(self, peer: _Peer) -> bool:
        """Returns whether to accept a connection; closes another one for it if necessary."""
        # A set, since a connection that has just started is in both.
        others: set[_Peer] = {*self._starting.values()}
        for handler in self._server.connections:
            if handler.transport is not None:
                # None if the client had disconnected before.
                others.add(handler.transport.get_extra_info("peername") or ("",))
        address = peer[0]
        if sum(other[0] == address for other in others) >= MAX_OF_ADDRESS:
            self._log.warn(f"web viewer: too many connections from {address}")
            return False
        if len(others) >= connection_limit(MAX_CONNECTIONS):
            self._log.warn("web viewer: too many connections")
            return self._drop_oldest()
        return True

    async def _serve(self, connection: socket.socket) -> None:
        try:
            transport, _ = await self._loop.connect_accepted_socket(self._server, connection)
        except OSError:  # The client has disconnected.
            connection.close()
            return
        self._silent[transport] = self._loop.call_later(HEADER_TIMEOUT, self._drop, transport)

    def _drop(self, transport: asyncio.Transport) -> None:
        self.received_request(transport)
        transport.abort()

    def _drop_oldest(self) -> bool:
        """Closes the oldest connection without a request; returns whether there is one."""
        for transport in list(self._silent):
            was_open = not transport.is_closing()
            self._drop(transport)
            if was_open:
                return True
        return False

    def _pause(self) -> None:
        """Waits for file descriptors."""
        self._drop_oldest()
        self._loop.remove_reader(self._listener)
        self._loop.call_later(EXHAUSTED_PERIOD, self._resume)

    def _resume(self) -> None:
        if not self._closed:
            self._loop.add_reader(self._listener, self._accept)
