"""Topics whose message is made for those who come; publisher here, subscribers in processes."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from std_msgs.msg import Int32
from waiting import TIMEOUT

from flatland.errors import FlatlandError
from flatland.ros.latched_topic import LatchedTopic
from flatland.ros.registrar import Registrar

TOPIC = "/flatland_tests/state"


class State:
    """What the topic tells of, and how often its message was made."""

    def __init__(self) -> None:
        self.value = 0
        self.made = 0
        self.connections: list[bool] = []
        self._lock = threading.Lock()

    def make(self) -> Int32:
        self.made += 1
        return Int32(self.value)

    def post(self, action: Callable[[], object]) -> Future[Any]:
        """Runs actions one at a time, as between two steps."""
        future: Future[Any] = Future()
        with self._lock:
            future.set_result(action())
        return future


@pytest.fixture
def state() -> State:
    return State()


@pytest.fixture
def registrar(ros: Any) -> Iterator[Registrar]:
    registrar = Registrar()
    yield registrar
    registrar.close(TIMEOUT)


@pytest.fixture
def topic(registrar: Registrar, state: State) -> Iterator[LatchedTopic]:
    topic = LatchedTopic(
        registrar, TOPIC, Int32, state.make, state.post, on_connection=state.connections.append
    )
    assert registrar.flush(TIMEOUT)
    yield topic
    topic.close()
    assert registrar.flush(TIMEOUT)


@pytest.fixture
def echo(launcher: Any) -> Callable[..., Any]:
    """Starts a subscriber in another process."""

    def start(*options: str) -> Any:
        return launcher.program("rostopic", "echo", *options, TOPIC)

    return start


def test_nothing_is_made_for_nobody(topic: LatchedTopic, state: State) -> None:
    topic.send()
    topic.replace(state.make)
    assert state.made == 0
    assert not topic.connected


def test_each_subscriber_gets_the_state_of_its_time(
    topic: LatchedTopic, state: State, echo: Callable[..., Any]
) -> None:
    state.value = 1
    first = echo()
    first.wait_for_line("data: 1")
    assert state.made == 1
    state.value = 2  # Not told to anybody.
    second = echo("-n", "1")
    second.wait_for_line("data: 2")
    assert second.wait() == 0
    state.value = 3
    topic.send()
    first.wait_for_line("data: 3")
    assert [line for line in first.lines if "data" in line] == ["data: 1", "data: 3"]
    assert state.made == 3
    assert state.connections[0] is False
    assert True in state.connections


def test_nothing_is_kept_for_those_who_come_later(
    topic: LatchedTopic, state: State, echo: Callable[..., Any], eventually: Any
) -> None:
    first = echo("-n", "1")
    first.wait_for_line("data: 0")
    assert first.wait() == 0
    eventually("nobody", lambda: not topic.connected)
    state.value = 5
    topic.send()
    assert state.made == 1
    second = echo("-n", "1")
    second.wait_for_line("data: 5")
    assert second.wait() == 0


def test_something_else_is_told(
    topic: LatchedTopic, state: State, echo: Callable[..., Any]
) -> None:
    subscriber = echo()
    subscriber.wait_for_line("data: 0")
    topic.replace(lambda: Int32(77))
    subscriber.wait_for_line("data: 77")
    late = echo("-n", "1")
    late.wait_for_line("data: 77")


def test_who_has_the_state_is_told_of_what_comes_next(
    topic: LatchedTopic, echo: Callable[..., Any]
) -> None:
    connected_when_made = []

    def make() -> Int32:
        connected_when_made.append(topic.connected)
        return Int32(4)

    topic.replace(make)
    echo().wait_for_line("data: 4")
    assert connected_when_made == [True]


def test_second_topic_of_the_name_serves_those_who_are_there(
    topic: LatchedTopic, registrar: Registrar, state: State, echo: Callable[..., Any]
) -> None:
    subscriber = echo()
    subscriber.wait_for_line("data: 0")
    second = LatchedTopic(registrar, TOPIC, Int32, lambda: Int32(9), state.post)
    topic.close()
    subscriber.wait_for_line("data: 9")
    assert registrar.flush(TIMEOUT)
    late = echo("-n", "1")
    late.wait_for_line("data: 9")
    second.send()
    second.close()
    second.send()
    topic.send()


def test_another_type_is_refused(topic: LatchedTopic, registrar: Registrar, state: State) -> None:
    from std_msgs.msg import String

    with pytest.raises(FlatlandError, match="has the type std_msgs/Int32 already"):
        LatchedTopic(registrar, TOPIC, String, String, state.post)
