"""The outbox of a connection: order, whole messages, the newest survive, nothing waits."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from typing import Any

import pytest
from rospy.exceptions import TransportTerminated
from waiting import TIMEOUT, wait_until

from flatland.ros.outbox import Outbox


class Transport:
    """As much of rospy's connection as an outbox knows."""

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
    """An outbox with small buffers, and the reader at the other end."""

    def __init__(self, queue_size: int) -> None:
        ours, self.reader = socket.socketpair()
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        self.reader.settimeout(TIMEOUT)
        self.transport = Transport(ours)
        self.outbox = Outbox(self.transport, queue_size)

    def write(self, number: int, size: int = 1000) -> None:
        self.transport.write_data(struct.pack("<II", number, size) + bytes([number % 251]) * size)

    def read(self) -> int:
        """Reads one message, checks that it is whole, and returns its number."""
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


def test_reader_that_keeps_up_gets_everything(pair: Pair) -> None:
    for number in range(500):
        pair.write(number)
        assert pair.read() == number
    assert pair.transport.stat_num_msg == 500
    assert pair.transport.stat_bytes == 500 * 1008


def test_write_never_waits_and_the_newest_arrive_at_last(pair: Pair) -> None:
    # A write that waited for this reader would never return.
    for number in range(2000):
        pair.write(number)
    numbers = [pair.read()]
    while numbers[-1] != 1999:
        numbers.append(pair.read())
    assert numbers == sorted(set(numbers))
    assert len(numbers) < 1000
    queue_size = pair.outbox._waiting.maxlen
    assert queue_size is not None
    assert numbers[-queue_size:] == list(range(2000 - queue_size, 2000))


def test_message_greater_than_any_buffer_arrives_whole(pair: Pair) -> None:
    pair.write(7, 3_000_000)
    pair.write(8)
    assert [pair.read(), pair.read()] == [7, 8]
    assert pair.transport.stat_num_msg == 2


def test_writing_goes_on_after_the_reader_caught_up(pair: Pair) -> None:
    for number in range(100):
        pair.write(number)
    while pair.read() != 99:
        pass
    for number in range(100, 200):
        pair.write(number)
        assert pair.read() == number


def test_reader_that_goes_ends_the_connection(pair: Pair) -> None:
    for number in range(100):
        pair.write(number)
    pair.reader.close()
    # The flusher notices by itself, without another message.
    wait_until("end of the connection", lambda: pair.transport.done)
    with pytest.raises(TransportTerminated):
        pair.write(100)


def test_closed_connection_takes_nothing(pair: Pair) -> None:
    pair.transport.close()
    with pytest.raises(TransportTerminated):
        pair.write(1)
