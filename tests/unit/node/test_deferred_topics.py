"""Topics that are opened after the first step, without ROS."""

from __future__ import annotations

import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from waiting import wait_until

import flatland
from flatland.node.deferred_topics import DeferredTopics
from flatland.node.values import Diagnostics
from flatland.simulation import Simulation


class Setup:
    """A world whose requests the test processes, and what is opened besides its topics.

    Attributes:
        loaders: Threads in which modules are imported.
        opened: Arguments of the debug markers and of the server of handles.
        closed: Whether the debug markers are closed.
    """

    def __init__(self, world: flatland.World, transport: Any) -> None:
        self.world, self.transport = world, transport
        self.simulation = Simulation(world)
        self.loaders: list[threading.Thread] = []
        self.opened: dict[str, tuple[Any, ...]] = {}
        self.closed = False
        transport.load_debug_markers = lambda: self._load("markers")
        transport.load_handle_server = lambda: self._load("handles")

    def _load(self, kind: str) -> Callable[..., Any]:
        self.loaders.append(threading.current_thread())

        def create(*arguments: Any) -> Any:
            self.opened[kind] = arguments
            return SimpleNamespace(close=self._close)

        return create

    def _close(self) -> None:
        self.closed = True

    def start(self, debug_rate: float | None = 30.0) -> DeferredTopics:
        return DeferredTopics(
            self.transport, self.simulation, debug_rate=debug_rate, move_keeps_odometry=True
        )

    def open(self, topics: DeferredTopics) -> set[str]:
        """Processes requests until the end of the start; returns the topics."""

        def is_open() -> bool:
            self.world.requests.process()
            return topics.opened.is_set()

        wait_until("the topics", is_open)
        return set(self.transport.topics)


@pytest.fixture
def setup(empty_world: flatland.World, transport: Any) -> Setup:
    return Setup(empty_world, transport)


def test_topics_are_opened_after_the_first_step(setup: Setup) -> None:
    topics = setup.start()
    before = set(threading.enumerate())
    setup.world.requests.process()  # before the first step
    started = {each.name for each in set(threading.enumerate()) - before}
    assert "flatland-deferred-topics" not in started
    assert setup.open(topics) == {"~paused", "/diagnostics"}
    assert {(each.name, each.daemon) for each in setup.loaders} == {
        ("flatland-deferred-topics", True)
    }
    assert setup.opened["markers"][:2] == (setup.simulation, 30.0)
    post, handles = setup.opened["handles"]
    assert post == setup.simulation.post
    assert handles._keep_odometry
    assert not setup.closed
    topics.close()
    assert setup.closed


def test_markers_and_handles_are_optional(setup: Setup, caplog: pytest.LogCaptureFixture) -> None:
    setup.transport.load_handle_server = lambda: None
    topics = setup.start(debug_rate=None)
    assert setup.open(topics) == {"~paused", "/diagnostics"}
    assert setup.opened == {}
    assert caplog.records == []
    topics.close()


def test_nothing_is_opened_after_the_end(setup: Setup) -> None:
    topics = setup.start()
    topics.close()
    assert setup.open(topics) == set()
    assert setup.opened == {}


@pytest.mark.parametrize("missing", ["handles", "diagnostics"])
def test_a_missing_package_of_messages_is_reported(
    setup: Setup, caplog: pytest.LogCaptureFixture, missing: str
) -> None:
    def fail(*_: object) -> None:
        raise ImportError("no package")

    publishable = setup.transport.publishable
    if missing == "handles":
        setup.transport.load_handle_server = fail
    else:
        setup.transport.publishable = lambda kind: (fail if kind is Diagnostics else publishable)(
            kind
        )
    topics = setup.start()
    assert setup.open(topics) == {"~paused"}
    assert set(setup.opened) == {"markers"} | ({"handles"} - {missing})
    [record] = caplog.records
    text = "markers or diagnostics are disabled: no package"
    assert (record.levelname, record.getMessage()) == ("WARNING", text)
    topics.close()


def test_a_part_that_fails_is_reported_and_does_not_prevent_the_others(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("cause")

    setup.transport.load_debug_markers = lambda: fail
    topics = setup.start()
    assert setup.open(topics) == {"~paused", "/diagnostics"}
    assert set(setup.opened) == {"handles"}
    [record] = caplog.records
    text = "cannot publish debug markers: cause"
    assert (record.levelname, record.getMessage()) == ("ERROR", text)
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "cause"
    topics.close()
