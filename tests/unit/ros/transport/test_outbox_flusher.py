"""Outboxes with connections that the test controls, and what the flusher watches."""

from __future__ import annotations

import logging
import select
import socket
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

from rospy.exceptions import TransportTerminated

from flatland.ros.transport import outbox as module
from flatland.ros.transport.outbox import Outbox, _Flusher, open_outboxes


class Connection:
    """A socket that accepts as many bytes as the test allows.

    Attributes:
        room: Bytes that the socket accepts.
        sent: The bytes that were sent.
        options: Calls of `setsockopt` and `setblocking`.
    """

    def __init__(self) -> None:
        self.room = 0
        self.sent = b""
        self.options: list[tuple[Any, ...]] = []
        self.error: OSError | None = None

    def send(self, data: memoryview) -> int:
        if self.error is not None:
            raise self.error
        if not self.room:
            raise BlockingIOError
        part = bytes(data[: self.room])
        self.room -= len(part)
        self.sent += part
        return len(part)

    def setblocking(self, *arguments: Any) -> None:
        self.options.append(arguments)

    def setsockopt(self, *arguments: Any) -> None:
        if self.error is not None:
            raise self.error
        self.options.append(arguments)

    def fileno(self) -> int:
        return 42


class Flusher:
    """Records what is watched."""

    def __init__(self) -> None:
        self.watched: list[Outbox] = []
        self.forgotten: list[tuple[Outbox, int]] = []

    def watch(self, outbox: Outbox) -> None:
        self.watched.append(outbox)

    def forget(self, outbox: Outbox, number: int) -> None:
        self.forgotten.append((outbox, number))


class Setup:
    """An outbox with a queue of two messages."""

    def __init__(self, flusher: Flusher) -> None:
        self.flusher = flusher
        self.connection = Connection()
        self.transport = SimpleNamespace(
            socket=self.connection,
            done=False,
            name="/scan",
            endpoint_id="/rviz",
            stat_bytes=0,
            stat_num_msg=0,
            closed=0,
            fileno=lambda: 42,
        )
        self.transport.set_cleanup_callback = lambda call: setattr(self.transport, "cleanup", call)
        self.transport.close = self._close
        self.outbox = Outbox(self.transport, 2)
        self.write = self.transport.write_data

    def _close(self) -> None:
        self.transport.closed += 1
        self.transport.done = True


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch) -> Setup:
    flusher = Flusher()
    monkeypatch.setattr(module, "_flusher", lambda: flusher)
    return Setup(flusher)


def test_an_outbox_belongs_to_its_connection(setup: Setup) -> None:
    outbox = setup.outbox
    assert (outbox.topic, outbox.subscriber, outbox.closed) == ("/scan", "/rviz", False)
    assert outbox.fileno() == 42
    assert setup.connection.options == [(False,)]
    assert outbox in open_outboxes()
    setup.transport.cleanup(setup.transport)
    assert setup.flusher.forgotten == [(outbox, 42)]
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
    assert setup.flusher.watched == []
    setup.write(b"bbb")  # of which two bytes are sent
    assert (connection.sent, transport.stat_bytes, transport.stat_num_msg) == (b"aabb", 4, 2)
    assert setup.flusher.watched == [outbox]
    for message in (b"cc", b"dd"):
        setup.write(message)
    assert outbox.dropped == 0
    setup.write(b"ee")
    setup.write(b"ff")
    assert outbox.dropped == 2
    assert setup.flusher.watched == [outbox]
    connection.room = 2
    outbox.flush()
    assert connection.sent == b"aabbbe"
    assert setup.flusher.watched == [outbox] * 2
    connection.room = 100
    outbox.flush()
    assert connection.sent == b"aabbbeeff"
    assert (transport.stat_bytes, transport.stat_num_msg) == (9, 4)
    assert setup.flusher.watched == [outbox] * 2
    setup.write(b"g")
    assert connection.sent == b"aabbbeeffg"
    assert outbox.dropped == 2


def test_a_message_that_cannot_be_sent_at_all_waits_whole(setup: Setup) -> None:
    setup.write(b"aa")
    setup.write(b"bb")
    assert setup.outbox.dropped == 0
    setup.write(b"cc")
    assert setup.outbox.dropped == 1
    setup.connection.room = 100
    setup.outbox.flush()
    assert setup.connection.sent == b"bbcc"


def test_a_broken_connection_is_closed_by_the_flusher(setup: Setup) -> None:
    setup.write(b"aa")
    setup.connection.error = BrokenPipeError("broken")
    setup.outbox.flush()
    assert setup.transport.closed == 1
    with pytest.raises(TransportTerminated, match="connection closed"):
        setup.write(b"bb")
    setup.transport.done = False
    setup.transport.socket = None
    with pytest.raises(TransportTerminated, match="connection closed"):
        setup.outbox._send()
    assert len(setup.outbox._queue) == 0


def test_a_connection_that_breaks_during_a_write_is_reported(setup: Setup) -> None:
    setup.connection.error = ConnectionResetError("reset")
    with pytest.raises(TransportTerminated, match="reset"):
        setup.write(b"aa")
    assert setup.transport.closed == 0  # rospy removes it


def test_a_connection_without_delay_is_set_up_once(setup: Setup) -> None:
    for _ in range(2):
        setup.outbox.disable_delay()
    assert setup.connection.options[1:] == [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]
    for closed in (setup.connection, None):
        other = Setup(setup.flusher)
        other.connection.error = OSError("closed")
        other.transport.socket = closed and other.connection
        other.outbox.disable_delay()
        other.outbox.disable_delay()


# -- the flusher -----------------------------------------------------------------------------------


class Epoll:
    """Records calls; the events are those of the test."""

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.known: set[int] = set()
        self.error: OSError | None = None
        self.events: list[list[tuple[int, int]]] = []

    def modify(self, number: int, flags: int) -> None:
        if self.error is not None:
            raise self.error
        if number not in self.known:
            raise FileNotFoundError
        self.calls.append(("modify", number, flags))

    def register(self, number: int, flags: int) -> None:
        self.known.add(number)
        self.calls.append(("register", number, flags))

    def poll(self) -> list[tuple[int, int]]:
        return self.events.pop(0)


class Box:
    """An outbox that counts how often it is flushed."""

    def __init__(self, number: int, error: Exception | None = None) -> None:
        self.number = number
        self.error = error
        self.flushed = 0

    def fileno(self) -> int:
        return self.number

    def flush(self) -> None:
        self.flushed += 1
        if self.error is not None:
            raise self.error


@pytest.fixture
def epoll() -> Epoll:
    return Epoll()


@pytest.fixture
def flusher(epoll: Epoll) -> Any:
    flusher = _Flusher()
    flusher._epoll = epoll  # type: ignore[assignment]
    return flusher


def test_a_socket_is_watched_for_one_event(flusher: Any, epoll: Epoll) -> None:
    flags = select.EPOLLOUT | select.EPOLLONESHOT
    box = Box(0)
    for _ in range(2):
        flusher.watch(box)
    assert epoll.calls == [("register", 0, flags), ("modify", 0, flags)]
    assert flusher._watched == {0: box}
    flusher.watch(Box(-1))
    assert len(epoll.calls) == 2
    epoll.error = OSError("closed in the meantime")
    flusher.watch(Box(5))
    assert flusher._watched == {0: box}


def test_a_socket_with_the_number_of_a_closed_one_stays(flusher: Any) -> None:
    old, new = Box(5), Box(5)
    flusher.watch(new)
    flusher.forget(old, 5)
    assert flusher._watched == {5: new}
    flusher.forget(new, 5)
    flusher.forget(new, 5)
    assert flusher._watched == {}


def test_an_outbox_is_flushed_once_and_failures_end_nothing(
    flusher: Any, epoll: Epoll, caplog: pytest.LogCaptureFixture
) -> None:
    boxes = [Box(1, RuntimeError("cause")), Box(2)]
    for box in boxes:
        flusher.watch(box)
    epoll.events = [[(1, 4), (2, 4)], [(1, 4), (2, 4), (3, 4)]]
    with pytest.raises(IndexError):  # at the end of the events
        flusher.run()
    assert [box.flushed for box in boxes] == [1, 1]
    [record] = caplog.records
    assert (record.levelno, record.getMessage()) == (logging.ERROR, "cannot send a message")
    assert record.exc_info is not None


def test_the_flusher_is_one_daemon_thread_of_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[Any] = []
    monkeypatch.setattr(module, "_the_flusher", None)
    monkeypatch.setattr(_Flusher, "start", lambda flusher: started.append(flusher))
    flusher = module._flusher()
    assert module._flusher() is flusher
    assert started == [flusher]
    assert flusher.daemon
    assert flusher.name == "flatland-flusher"
