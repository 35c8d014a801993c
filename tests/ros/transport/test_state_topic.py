"""State topics; the publisher is in this process, the subscribers in others."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from std_msgs.msg import Int32
from waiting import TIMEOUT

from flatland.errors import FlatlandError
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.state_topic import StateTopic

TOPIC = "/flatland_tests/state"


class State:
    """State to publish, and the number of messages created."""

    def __init__(self) -> None:
        self.value = 0
        self.created = 0
        self.connections: list[bool] = []
        self._lock = threading.Lock()

    def make(self) -> Int32:
        self.created += 1
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
def topic(registrar: Registrar, state: State) -> Iterator[StateTopic]:
    topic = StateTopic(
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


def test_no_message_is_created_without_subscribers(topic: StateTopic, state: State) -> None:
    topic.send()
    topic.replace(state.make)
    assert state.created == 0
    assert not topic.connected


def test_new_subscriber_receives_the_current_state(
    topic: StateTopic, state: State, echo: Callable[..., Any]
) -> None:
    state.value = 1
    first = echo()
    first.wait_for_line("data: 1")
    assert state.created == 1
    state.value = 2  # Not published.
    second = echo("-n", "1")
    second.wait_for_line("data: 2")
    assert second.wait() == 0
    state.value = 3
    topic.send()
    first.wait_for_line("data: 3")
    assert [line for line in first.lines if "data" in line] == ["data: 1", "data: 3"]
    assert state.created == 3
    assert state.connections[0] is False
    assert True in state.connections


def test_no_message_is_stored_for_late_subscribers(
    topic: StateTopic, state: State, echo: Callable[..., Any], eventually: Any
) -> None:
    first = echo("-n", "1")
    first.wait_for_line("data: 0")
    assert first.wait() == 0
    eventually("no subscribers", lambda: not topic.connected)
    state.value = 5
    topic.send()
    assert state.created == 1
    second = echo("-n", "1")
    second.wait_for_line("data: 5")
    assert second.wait() == 0


def test_replaced_state_is_published(
    topic: StateTopic, state: State, echo: Callable[..., Any]
) -> None:
    subscriber = echo()
    subscriber.wait_for_line("data: 0")
    topic.replace(lambda: Int32(77))
    subscriber.wait_for_line("data: 77")
    late = echo("-n", "1")
    late.wait_for_line("data: 77")


def test_topic_is_connected_before_the_first_message(
    topic: StateTopic, echo: Callable[..., Any]
) -> None:
    connected_when_made = []

    def make() -> Int32:
        connected_when_made.append(topic.connected)
        return Int32(4)

    topic.replace(make)
    echo().wait_for_line("data: 4")
    assert connected_when_made == [True]


def test_second_topic_of_the_same_name_publishes_to_existing_subscribers(
    topic: StateTopic, registrar: Registrar, state: State, echo: Callable[..., Any]
) -> None:
    subscriber = echo()
    subscriber.wait_for_line("data: 0")
    second = StateTopic(registrar, TOPIC, Int32, lambda: Int32(9), state.post)
    topic.close()
    subscriber.wait_for_line("data: 9")
    assert registrar.flush(TIMEOUT)
    late = echo("-n", "1")
    late.wait_for_line("data: 9")
    second.send()
    second.close()
    second.send()
    topic.send()


def test_different_type_raises(topic: StateTopic, registrar: Registrar, state: State) -> None:
    from std_msgs.msg import String

    with pytest.raises(FlatlandError, match="has the type std_msgs/Int32 already"):
        StateTopic(registrar, TOPIC, String, String, state.post)
