"""Writes to subscribers without ever waiting for one.

rospy offers two ways: a thread for each connection, which costs ten times as much as the write
itself, or a write in the caller's thread, which waits for ever for a subscriber that does not
read. Here the caller's thread writes what the socket takes at once; what it does not take stays
in the connection's outbox, and one thread for all of them sends it when the socket has room.
"""

from __future__ import annotations

import logging
import select
import socket
import threading
from collections import deque
from typing import Any

from rospy.exceptions import TransportTerminated

_LOG = logging.getLogger("flatland")


class Outbox:
    """What one connection of a publisher has yet to send.

    Takes the place of the connection's own `write_data`. A message is sent whole or not at all:
    of those that wait the oldest ones are dropped, never one that is under way.
    """

    def __init__(self, transport: Any, queue_size: int) -> None:
        """Takes over the writing of a connection.

        Args:
            transport: rospy's `TCPROSTransport`, its handshake done.
            queue_size: How many whole messages wait at most.
        """
        self._transport = transport
        self._lock = threading.Lock()
        self._under_way: memoryview | None = None
        self._waiting: deque[bytes] = deque(maxlen=queue_size)
        transport.socket.setblocking(False)
        transport.set_cleanup_callback(self._closed)
        transport.write_data = self.write

    def write(self, data: bytes) -> None:
        """Sends a message as far as the socket takes it; never waits.

        Raises:
            TransportTerminated: The connection is closed, or broke; rospy drops it then.
        """
        if self._transport.done:
            raise TransportTerminated("connection closed")
        with self._lock:
            self._waiting.append(data)
            if self._under_way is not None or len(self._waiting) > 1:
                return  # The flusher has been told already, and the order must be kept.
            if not self._send():
                _flusher().watch(self)

    def fileno(self) -> int:
        """Returns the socket's file descriptor, -1 when it is closed."""
        connection: socket.socket | None = self._transport.socket
        return -1 if connection is None else connection.fileno()

    def flush(self) -> None:
        """Sends what waits; called by the flusher when the socket has room."""
        try:
            with self._lock:
                if not self._send():
                    _flusher().watch(self)
        except TransportTerminated:
            self._transport.close()

    def _send(self) -> bool:
        """Sends until all is sent or the socket takes no more; tells whether all is sent."""
        connection: socket.socket | None = self._transport.socket
        if connection is None or self._transport.done:
            self._waiting.clear()
            raise TransportTerminated("connection closed")
        while self._under_way is not None or self._waiting:
            rest = self._under_way
            if rest is None:
                rest = memoryview(self._waiting[0])
            try:
                sent = connection.send(rest)
            except BlockingIOError:
                return False
            except OSError as error:
                raise TransportTerminated(str(error)) from error
            self._transport.stat_bytes += sent
            if self._under_way is None:
                self._waiting.popleft()
                self._transport.stat_num_msg += 1
            self._under_way = rest[sent:] if sent < len(rest) else None
        return True

    def _closed(self, transport: Any) -> None:
        """Forgets the flusher's watch; rospy calls it when the connection is closed."""
        _flusher().forget(self, transport.fileno())


class _Flusher(threading.Thread):
    """Sends what outboxes could not, whenever a socket has room again."""

    def __init__(self) -> None:
        super().__init__(name="flatland-flusher", daemon=True)
        self._epoll = select.epoll()
        self._lock = threading.Lock()
        self._watched: dict[int, Outbox] = {}

    def watch(self, outbox: Outbox) -> None:
        """Calls `flush` of an outbox once, as soon as its socket has room or breaks."""
        number = outbox.fileno()
        if number < 0:
            return
        flags = select.EPOLLOUT | select.EPOLLONESHOT
        with self._lock:
            self._watched[number] = outbox
            try:
                try:
                    self._epoll.modify(number, flags)
                except FileNotFoundError:
                    self._epoll.register(number, flags)
            except OSError:
                del self._watched[number]  # Closed just now: there is nothing left to do.

    def forget(self, outbox: Outbox, number: int) -> None:
        """Drops an outbox whose socket was closed."""
        with self._lock:
            if self._watched.get(number) is outbox:
                del self._watched[number]

    def run(self) -> None:
        """Waits for sockets, for ever."""
        while True:
            for number, _ in self._epoll.poll():
                with self._lock:
                    outbox = self._watched.pop(number, None)
                if outbox is not None:
                    try:
                        outbox.flush()
                    except Exception:
                        _LOG.exception("a message could not be sent")


_flusher_lock = threading.Lock()
_the_flusher: _Flusher | None = None


def _flusher() -> _Flusher:
    """Returns the process's flusher, started at its first use."""
    global _the_flusher
    with _flusher_lock:
        if _the_flusher is None:
            _the_flusher = _Flusher()
            _the_flusher.start()
        return _the_flusher
