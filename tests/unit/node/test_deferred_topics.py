"""Topics that are opened after the first step, without ROS."""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import pytest
from waiting import TIMEOUT, wait_until

from flatland.node import deferred_topics, diagnostics, handles, states
from flatland.node.deferred_topics import DeferredTopics


class Loop:
    """The loop of a simulation, whose actions the test runs.

    Attributes:
        thread_names: Names of the threads that have posted actions; the thread of the topics is
            the only one besides that of the test.
    """

    def __init__(self) -> None:
        self.thread_names: set[tuple[str, bool]] = set()
        self._actions: queue.Queue[tuple[Future[Any], Callable[[], object]]] = queue.Queue()

    def post(self, action: Callable[[], object]) -> Future[Any]:
        thread = threading.current_thread()
        if thread is not threading.main_thread():
            self.thread_names.add((thread.name, thread.daemon))
        future: Future[Any] = Future()
        self._actions.put((future, action))
        return future

    def run_one(self) -> None:
        future, action = self._actions.get(timeout=TIMEOUT)
        try:
            future.set_result(action())
        except Exception as error:
            future.set_exception(error)

    def run_until(self, event: threading.Event) -> None:
        while not event.is_set():
            self.run_one()

    @property
    def is_empty(self) -> bool:
        return self._actions.empty()


class Part:
    """A topic that records how it is created."""

    def __init__(self, kind: str, opened: list[Any], *arguments: Any, **options: Any) -> None:
        self.closed = False
        self.created = (kind, arguments, options)
        opened.append(self)

    def close(self) -> None:
        self.closed = True


class Parts:
    """The parts that a transport opens.

    Attributes:
        opened: The parts, in their order.
        transport: Loads debug markers and the server of handles.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.opened: list[Part] = []
        self.imported: list[type[Any]] = []
        self.server: Any = object()
        self.transport = SimpleNamespace(
            load_debug_markers=lambda: self.kind("markers"),
            load_handle_server=lambda: self.server,
            publishable=self.imported.append,
        )
        monkeypatch.setattr(states, "PauseTopic", self.kind("paused"))
        monkeypatch.setattr(handles, "Handles", self.kind("handles"))
        monkeypatch.setattr(diagnostics, "DiagnosticsTopic", self.kind("diagnostics"))
        self.threads: list[tuple[Any, ...]] = []
        monkeypatch.setattr(deferred_topics, "TickerThread", self._thread)

    def _thread(self, *arguments: Any) -> str:
        self.threads.append(arguments)
        return "thread"

    def kind(self, name: str) -> Callable[..., Part]:
        return lambda *arguments, **options: Part(name, self.opened, *arguments, **options)


@pytest.fixture
def parts(monkeypatch: pytest.MonkeyPatch) -> Parts:
    return Parts(monkeypatch)


@pytest.fixture
def loop() -> Loop:
    return Loop()


def start(parts: Parts, loop: Any, debug_rate: float | None = 30.0) -> DeferredTopics:
    return DeferredTopics(parts.transport, loop, debug_rate=debug_rate, move_keeps_odometry=True)


def test_topics_are_opened_in_order_after_the_first_step(parts: Parts, loop: Loop) -> None:
    topics = start(parts, loop)
    loop.run_one()  # before the first step
    assert loop.thread_names == set()
    loop.run_until(topics.opened)
    assert [part.created for part in parts.opened] == [
        ("markers", (loop, 30.0, "thread"), {}),
        ("paused", (parts.transport, loop), {}),
        ("handles", (loop, "thread", parts.server), {"move_keeps_odometry": True}),
        ("diagnostics", (parts.transport, loop), {}),
    ]
    assert parts.threads == [("flatland-markers", loop.post)]
    assert parts.imported == [diagnostics.Diagnostics]
    assert loop.thread_names == {("flatland-deferred-topics", True)}
    assert loop.is_empty
    assert not any(part.closed for part in parts.opened)
    topics.close()
    assert all(part.closed for part in parts.opened)


def test_markers_and_handles_are_optional(parts: Parts, loop: Loop) -> None:
    parts.server = None
    topics = start(parts, loop, debug_rate=None)
    loop.run_until(topics.opened)
    assert [part.created[0] for part in parts.opened] == ["paused", "diagnostics"]


def test_nothing_is_opened_after_the_end(parts: Parts, loop: Loop) -> None:
    topics = start(parts, loop)
    topics.close()
    loop.run_until(topics.opened)
    assert parts.opened == []


def test_a_missing_package_of_messages_is_reported(
    parts: Parts, loop: Loop, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> None:
        raise ImportError("no package")

    parts.transport.load_handle_server = fail
    topics = start(parts, loop)
    loop.run_until(topics.opened)
    assert [part.created[0] for part in parts.opened] == ["markers", "paused"]
    [record] = caplog.records
    assert record.levelno == logging.WARNING
    assert record.getMessage() == "markers or diagnostics are disabled: no package"


def test_a_part_that_fails_is_reported_with_its_traceback(
    parts: Parts, loop: Loop, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("cause")

    monkeypatch.setattr(states, "PauseTopic", fail)
    topics = start(parts, loop)
    loop.run_until(topics.opened)
    assert [part.created[0] for part in parts.opened] == ["markers", "handles", "diagnostics"]
    [record] = caplog.records
    assert record.levelno == logging.ERROR
    assert record.getMessage() == "cannot publish the pause state: cause"
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "cause"


def test_a_topic_that_cannot_be_opened_does_not_prevent_the_others(
    serve: Any,
    transport: Any,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("no room for handles")

    monkeypatch.setattr(transport, "load_handle_server", lambda: fail)
    serve()
    wait_until("diagnostics", lambda: "/diagnostics" in transport.topics)
    assert "cannot publish interactive markers: no room for handles" in caplog.text
