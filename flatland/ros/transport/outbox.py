"""Non-blocking writes to subscribers.

rospy writes either in one thread per connection, which costs ten times as much as the write itself,
or in the thread of the caller, which blocks forever if a subscriber does not read. Here, the thread
of the caller writes as much as the socket accepts. The rest stays in the outbox of the connection;
a single thread for all connections sends it when the socket becomes writable.
"""

from __future__ import annotations

import logging
import select
import socket
import threading
import weakref
from collections import deque
from contextlib import suppress
from typing import Any

from rospy.exceptions import TransportTerminated

_LOG = logging.getLogger("flatland")


class Outbox:
    """Queue of unsent messages of one connection of a publisher.

    Replaces `write_data` of the connection. A message is sent completely or not at all: when the
    queue is full, the oldest message is dropped, but never one that is partially sent.

    Attributes:
        dropped: Number of dropped messages.
    """

    def __init__(self, transport: Any, queue_size: int) -> None:
        """Replaces `write_data` of a connection.

        Args:
            transport: A `TCPROSTransport` of rospy, after the handshake.
            queue_size: Maximum number of queued messages, without the partially sent one.
        """
        self._transport = transport
        self._lock = threading.Lock()
        self._partial: memoryview | None = None  # rest of the partially sent message
        self._queue: deque[bytes] = deque(maxlen=queue_size)
        self.dropped = 0
        self._is_undelayed = False
        transport.socket.setblocking(False)
        transport.set_cleanup_callback(self._closed)
        transport.write_data = self.write
        with _all_lock:
            _all.add(self)

    @property
    def topic(self) -> str:
        """Resolved name of the topic."""
        return str(self._transport.name)

    @property
    def subscriber(self) -> str:
        """Name of the node that receives the messages."""
        return str(self._transport.endpoint_id)

    @property
    def closed(self) -> bool:
        """Whether the connection is closed."""
        return bool(self._transport.done)

    def write(self, data: bytes) -> None:
        """Sends or queues a message without blocking.

        Args:
            data: The serialized message.

        Raises:
            TransportTerminated: The connection is closed or broken; rospy removes it.
        """
        if self._transport.done:
            raise TransportTerminated("connection closed")
        with self._lock:
            if self._partial is not None or self._queue:
                # The flusher already watches the socket; keep the order.
                if len(self._queue) == self._queue.maxlen:
                    self.dropped += 1
                self._queue.append(data)
                return
            sent = self._send_part(data)
            if sent:
                self._transport.stat_num_msg += 1
            if sent == len(data):
                return
            if sent:
                self._partial = memoryview(data)[sent:]
            else:
                self._queue.append(data)
            _flusher().watch(self)

    def disable_delay(self) -> None:
        """Disables the delay of small messages by the system, and sends waiting messages.

        By default (Nagle's algorithm), a small message waits for up to 40 ms until the subscriber
        has acknowledged the previous one, which is cheaper for many messages.
        """
        if not self._is_undelayed:
            self._is_undelayed = True
            connection: socket.socket | None = self._transport.socket
            with suppress(OSError):  # closed
                if connection is not None:
                    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def fileno(self) -> int:
        """Returns the file descriptor of the socket, -1 if it is closed."""
        connection: socket.socket | None = self._transport.socket
        return -1 if connection is None else connection.fileno()

    def flush(self) -> None:
        """Sends queued messages; called by the flusher when the socket is writable."""
        try:
            with self._lock:
                if not self._send():
                    _flusher().watch(self)
        except TransportTerminated:
            self._transport.close()

    def _send(self) -> bool:
        """Sends queued messages until the socket would block; returns whether all were sent."""
        while self._partial is not None or self._queue:
            rest = self._partial
            if rest is None:
                rest = memoryview(self._queue[0])
            sent = self._send_part(rest)
            if not sent:
                return False
            if self._partial is None:
                self._queue.popleft()
                self._transport.stat_num_msg += 1
            self._partial = rest[sent:] if sent < len(rest) else None
        return True

    def _send_part(self, data: bytes | memoryview) -> int:
        """Sends a part of a message; returns the number of bytes that the socket has accepted."""
        connection: socket.socket | None = self._transport.socket
        if connection is None or self._transport.done:
            self._queue.clear()
            raise TransportTerminated("connection closed")
        try:
            sent = connection.send(data)
        except BlockingIOError:
            return 0
        except OSError as error:
            raise TransportTerminated(str(error)) from error
        self._transport.stat_bytes += sent
        return sent

    def _closed(self, transport: Any) -> None:
        """Stops watching the socket; called by rospy when the connection is closed."""
        _flusher().forget(self, transport.fileno())


_all: weakref.WeakSet[Outbox] = weakref.WeakSet()
_all_lock = threading.Lock()


def open_outboxes() -> list[Outbox]:
    """Returns the outboxes of all open connections of this process."""
    with _all_lock:
        outboxes = list(_all)
    return [outbox for outbox in outboxes if not outbox.closed]


class _Flusher(threading.Thread):
    """Thread that flushes outboxes when their sockets become writable."""

    def __init__(self) -> None:
        super().__init__(name="flatland-flusher", daemon=True)
        self._epoll = select.epoll()
        self._lock = threading.Lock()
        self._watched: dict[int, Outbox] = {}

    def watch(self, outbox: Outbox) -> None:
        """Calls `flush` of an outbox once, when its socket becomes writable or breaks."""
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
                del self._watched[number]  # The socket was closed in the meantime.

    def forget(self, outbox: Outbox, number: int) -> None:
        """Removes an outbox whose socket was closed."""
        with self._lock:
            if self._watched.get(number) is outbox:
                del self._watched[number]

    def run(self) -> None:
        """Waits for writable sockets until the process ends."""
        while True:
            for number, _ in self._epoll.poll():
                with self._lock:
                    outbox = self._watched.pop(number, None)
                if outbox is not None:
                    try:
                        outbox.flush()
                    except Exception:
                        _LOG.exception("cannot send a message")


_flusher_lock = threading.Lock()
_the_flusher: _Flusher | None = None


def _flusher() -> _Flusher:
    """Returns the flusher of the process, starting it on first use."""
    global _the_flusher
    with _flusher_lock:
        if _the_flusher is None:
            _the_flusher = _Flusher()
            _the_flusher.start()
        return _the_flusher
