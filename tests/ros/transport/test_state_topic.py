"""State topics; the publisher and the subscribers are in this process."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from raw_subscriber import RawSubscriber
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
def topic(registrar: Registrar, state: State) -> Iterator[StateTopic]:
    topic = StateTopic(
        registrar, TOPIC, Int32, state.make, state.post, on_connection=state.connections.append
    )
    assert registrar.flush(TIMEOUT)
    yield topic
    topic.close()
    assert registrar.flush(TIMEOUT)


@pytest.fixture
def subscribe(ros: Any) -> Iterator[Callable[[], RawSubscriber]]:
    """Connects subscribers, each of them as a node of its own."""
    opened: list[RawSubscriber] = []

    def connect() -> RawSubscriber:
        name = f"/subscriber{len(opened)}"
        opened.append(RawSubscriber(ros.master, TOPIC, Int32, name=name))
        return opened[-1]

    yield connect
    for subscriber in opened:
        subscriber.close()


def test_no_message_is_created_without_subscribers(topic: StateTopic, state: State) -> None:
    topic.send()
    topic.replace(state.make)
    assert state.created == 0
    assert not topic.connected


def test_new_subscriber_receives_the_current_state(
    topic: StateTopic, state: State, subscribe: Callable[[], RawSubscriber]
) -> None:
    state.value = 1
    first = subscribe()
    assert first.next().data == 1
    assert state.created == 1
    state.value = 2  # Not published.
    assert subscribe().next().data == 2
    state.value = 3
    topic.send()
    assert first.next().data == 3
    assert state.created == 3
    assert state.connections[0] is False
    assert True in state.connections


def test_no_message_is_stored_for_late_subscribers(
    topic: StateTopic, state: State, subscribe: Callable[[], RawSubscriber], eventually: Any
) -> None:
    first = subscribe()
    assert first.next().data == 0
    first.close()
    eventually("no subscribers", lambda: not topic.connected)
    state.value = 5
    topic.send()
    assert state.created == 1
    assert subscribe().next().data == 5


def test_replaced_state_is_published(
    topic: StateTopic, subscribe: Callable[[], RawSubscriber]
) -> None:
    subscriber = subscribe()
    assert subscriber.next().data == 0
    topic.replace(lambda: Int32(77))
    assert subscriber.next().data == 77
    assert subscribe().next().data == 77


def test_topic_is_connected_before_the_first_message(
    topic: StateTopic, subscribe: Callable[[], RawSubscriber]
) -> None:
    connected_when_made = []

    def make() -> Int32:
        connected_when_made.append(topic.connected)
        return Int32(4)

    topic.replace(make)
    assert subscribe().next().data == 4
    assert connected_when_made == [True]


def test_second_topic_of_the_same_name_publishes_to_existing_subscribers(
    topic: StateTopic,
    registrar: Registrar,
    state: State,
    subscribe: Callable[[], RawSubscriber],
) -> None:
    subscriber = subscribe()
    assert subscriber.next().data == 0
    second = StateTopic(registrar, TOPIC, Int32, lambda: Int32(9), state.post)
    topic.close()
    assert subscriber.next().data == 9
    assert registrar.flush(TIMEOUT)
    assert subscribe().next().data == 9
    second.send()
    second.close()
    second.send()
    topic.send()


def test_different_type_raises(topic: StateTopic, registrar: Registrar, state: State) -> None:
    from std_msgs.msg import String

    with pytest.raises(FlatlandError, match="has the type std_msgs/Int32 already"):
        StateTopic(registrar, TOPIC, String, String, state.post)
