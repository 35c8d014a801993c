"""Outbox of a connection: order, complete messages, dropped messages, non-blocking writes."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from typing import Any

import pytest
from rospy.exceptions import TransportTerminated
from waiting import TIMEOUT, wait_until

from flatland.ros.transport.outbox import Outbox


class Transport:
    """The part of a rospy transport that an outbox uses."""

    def __init__(self, connection: socket.socket) -> None:
        self.socket: socket.socket | None = connection
        self.done = False
        self.stat_bytes = self.stat_num_msg = 0
        self._fileno = connection.fileno()
        self._cleanup: Any = None

    def set_cleanup_callback(self, callback: Any) -> None:
        self._cleanup = callback

    def fileno(self) -> int:
        return self._fileno

    def close(self) -> None:
        if not self.done:
            self.done = True
            assert self.socket is not None
            self.socket.close()
            self.socket = None
            self._cleanup(self)


class Pair:
    """An outbox with small socket buffers, and the reader of its connection."""

    def __init__(self, queue_size: int) -> None:
        writer, self.reader = socket.socketpair()
        writer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        self.reader.settimeout(TIMEOUT)
        self.transport = Transport(writer)
        self.outbox = Outbox(self.transport, queue_size)

    def write(self, number: int, size: int = 1000) -> None:
        self.transport.write_data(struct.pack("<II", number, size) + bytes([number % 251]) * size)

    def read(self) -> int:
        """Reads one message, checks that it is complete, and returns its number."""
        number, size = struct.unpack("<II", self._read(8))
        assert self._read(size) == bytes([number % 251]) * size
        return int(number)

    def _read(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            data += self.reader.recv(size - len(data))
        return data


@pytest.fixture(params=[1, 3])
def pair(request: pytest.FixtureRequest) -> Iterator[Pair]:
    pair = Pair(request.param)
    yield pair
    pair.transport.close()
    pair.reader.close()


def test_slow_reader_receives_the_newest_messages(pair: Pair) -> None:
    # A write that waited for this reader would never return.
    for number in range(2000):
        pair.write(number)
    numbers = [pair.read()]
    while numbers[-1] != 1999:
        numbers.append(pair.read())
    assert numbers == sorted(set(numbers))
    assert len(numbers) < 1000
    queue_size = pair.outbox._queue.maxlen
    assert queue_size is not None
    assert numbers[-queue_size:] == list(range(2000 - queue_size, 2000))
    # All further messages are received, since the reader has caught up.
    for number in range(2000, 2100):
        pair.write(number)
        assert pair.read() == number


def test_message_larger_than_the_socket_buffer_is_complete(pair: Pair) -> None:
    pair.write(7, 3_000_000)
    pair.write(8)
    assert [pair.read(), pair.read()] == [7, 8]
    # The flusher counts a message after it was sent.
    wait_until("count of both messages", lambda: pair.transport.stat_num_msg == 2)


def test_closed_reader_ends_the_connection(pair: Pair) -> None:
    for number in range(100):
        pair.write(number)
    pair.reader.close()
    # The flusher detects it, without another message.
    wait_until("end of the connection", lambda: pair.transport.done)
    with pytest.raises(TransportTerminated):
        pair.write(100)
