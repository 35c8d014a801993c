"""Outboxes of connections that accept a part of a message, and what the flusher watches."""

from __future__ import annotations

import logging
import select
import socket
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

from rospy.exceptions import TransportTerminated

from flatland.ros.transport import outbox as module
from flatland.ros.transport.outbox import Outbox, _Flusher, open_outboxes


class Connection(socket.socket):
    """A socket that accepts as many bytes as the test allows.

    Attributes:
        room: Bytes that the socket accepts.
        sent: The bytes that were sent.
    """

    room = 0
    sent = b""

    def send(self, data: Any, _flags: int = 0) -> int:
        if not self.room:
            raise BlockingIOError
        part = bytes(data[: self.room])
        self.room -= len(part)
        self.sent += part
        return len(part)


class Setup:
    """An outbox with a queue of two messages.

    Attributes:
        watched: The outboxes that the flusher is told to watch.
    """

    def __init__(self, connection: socket.socket) -> None:
        self.watched: list[Outbox] = []
        self.forgotten: list[tuple[Outbox, int]] = []
        self.connection = connection
        self.transport = SimpleNamespace(
            socket=connection,
            done=False,
            name="/scan",
            endpoint_id="/rviz",
            stat_bytes=0,
            stat_num_msg=0,
            fileno=lambda: 42,
        )
        self.transport.set_cleanup_callback = lambda call: setattr(self.transport, "cleanup", call)
        self.transport.close = lambda: setattr(self.transport, "done", True)
        self.outbox = Outbox(self.transport, 2)
        self.write = self.transport.write_data

    def watch(self, outbox: Outbox) -> None:
        self.watched.append(outbox)

    def forget(self, outbox: Outbox, number: int) -> None:
        self.forgotten.append((outbox, number))


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch) -> Iterator[Setup]:
    with Connection() as connection:
        setup = Setup(connection)
        monkeypatch.setattr(module, "_flusher", lambda: setup)
        yield setup


def test_an_outbox_belongs_to_its_connection(setup: Setup) -> None:
    outbox = setup.outbox
    assert (outbox.topic, outbox.subscriber, outbox.closed) == ("/scan", "/rviz", False)
    assert outbox.fileno() == setup.connection.fileno()
    assert not setup.connection.getblocking()
    assert outbox in open_outboxes()
    setup.transport.cleanup(setup.transport)
    assert setup.forgotten == [(outbox, 42)]
    setup.transport.done = True
    assert outbox.closed
    assert outbox not in open_outboxes()
    setup.transport.socket = None
    assert outbox.fileno() == -1


def test_the_oldest_message_is_dropped_but_never_a_part_of_one(setup: Setup) -> None:
    connection, outbox, transport = setup.connection, setup.outbox, setup.transport
    connection.room = 4
    setup.write(b"aa")
    assert (connection.sent, transport.stat_bytes, transport.stat_num_msg) == (b"aa", 2, 1)
    assert setup.watched == []
    setup.write(b"bbb")  # of which two bytes are sent
    assert (connection.sent, transport.stat_bytes, transport.stat_num_msg) == (b"aabb", 4, 2)
    assert setup.watched == [outbox]
    for message in (b"cc", b"dd"):
        setup.write(message)
    assert outbox.dropped == 0
    setup.write(b"ee")
    setup.write(b"ff")
    assert outbox.dropped == 2
    assert setup.watched == [outbox]
    connection.room = 2
    outbox.flush()
    assert connection.sent == b"aabbbe"
    assert setup.watched == [outbox] * 2
    connection.room = 100
    outbox.flush()
    assert connection.sent == b"aabbbeeff"
    assert (transport.stat_bytes, transport.stat_num_msg) == (9, 4)
    assert setup.watched == [outbox] * 2
    setup.write(b"g")
    assert connection.sent == b"aabbbeeffg"
    assert outbox.dropped == 2


def test_a_broken_connection_is_reported_by_a_write() -> None:
    connection, reader = socket.socketpair()
    with connection:
        setup = Setup(connection)
        reader.close()
        with pytest.raises(TransportTerminated, match="Broken pipe"):
            setup.write(b"aa")
        assert not setup.transport.done  # rospy closes it


def test_a_broken_connection_with_waiting_messages_is_closed_by_the_flusher(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    connection, reader = socket.socketpair()
    with connection:
        setup = Setup(connection)
        monkeypatch.setattr(module, "_flusher", lambda: setup)
        while not setup.watched:  # until the buffer of the socket is full
            setup.write(b"a" * 65536)
        reader.close()
        setup.outbox.flush()
        assert setup.transport.done
        with pytest.raises(TransportTerminated, match="connection closed"):
            setup.write(b"bb")


def test_nothing_is_sent_over_a_closed_connection(setup: Setup) -> None:
    setup.write(b"aa")
    setup.connection.room = 100
    for done in (True, False):  # The message was discarded.
        setup.transport.done = done
        setup.outbox.flush()
        assert setup.connection.sent == b""
    setup.transport.done, setup.transport.socket = False, None
    with pytest.raises(TransportTerminated, match="connection closed"):
        setup.write(b"bb")


def test_the_delay_of_a_connection_is_disabled_once(setup: Setup) -> None:
    option = (socket.IPPROTO_TCP, socket.TCP_NODELAY)
    setup.outbox.disable_delay()
    assert setup.connection.getsockopt(*option)
    setup.connection.setsockopt(*option, 0)
    setup.outbox.disable_delay()
    assert not setup.connection.getsockopt(*option)
    closed, gone = Setup(setup.connection), Setup(setup.connection)
    setup.connection.close()
    closed.outbox.disable_delay()
    gone.transport.socket = None
    gone.outbox.disable_delay()


# -- the flusher -----------------------------------------------------------------------------------


def box(connection: socket.socket, flush: Callable[[], None] = lambda: None) -> Any:
    """Returns an outbox."""
    return SimpleNamespace(fileno=connection.fileno, flush=flush)


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Two sockets that are writable."""
    first, second = socket.socketpair()
    with first, second:
        yield first, second


def test_a_socket_is_watched_for_one_event(pair: Any) -> None:
    flusher: Any = _Flusher()
    for _ in range(2):
        flusher.watch(box(pair[0]))
        assert flusher._epoll.poll(0) == [(pair[0].fileno(), select.EPOLLOUT)]
        assert flusher._epoll.poll(0) == []
    pair[1].close()
    flusher.watch(box(pair[1]))
    flusher.watch(SimpleNamespace(fileno=lambda: 1_000_000))  # closed in the meantime
    assert list(flusher._watched) == [pair[0].fileno()]
    flusher._epoll = MagicMock()
    flusher.watch(SimpleNamespace(fileno=lambda: 0))  # in a process without standard input
    assert 0 in flusher._watched
    assert (flusher.daemon, flusher.name) == (True, "flatland-flusher")


def test_an_outbox_is_flushed_once_and_failures_end_nothing(
    pair: tuple[socket.socket, socket.socket], caplog: pytest.LogCaptureFixture
) -> None:
    flusher: Any = _Flusher()
    flushed: list[str] = []

    def fail() -> None:
        flushed.append("failing")
        flusher.watch(box(pair[0], end))
        raise RuntimeError("cause")

    def end() -> None:
        flushed.append("end")
        raise SystemExit

    number = pair[1].fileno()
    gone = box(pair[1], lambda: flushed.append("gone"))
    flusher.watch(gone)
    for _ in range(2):
        flusher.forget(gone, number)
    flusher.watch(box(pair[0], fail))
    flusher.forget(box(pair[0]), pair[0].fileno())  # had the same number
    with pytest.raises(SystemExit):
        flusher.run()
    assert flushed == ["failing", "end"]
    [record] = caplog.records
    assert (record.levelno, record.getMessage()) == (logging.ERROR, "cannot send a message")
    assert record.exc_info is not None
