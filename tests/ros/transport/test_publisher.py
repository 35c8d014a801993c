"""Serialized messages of a publisher, received over two connections."""

from __future__ import annotations

import gc
import socket
import struct
import threading
import weakref
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped
from raw_subscriber import RawSubscriber
from std_msgs.msg import Int32, String
from waiting import TIMEOUT, wait_until

from flatland.ros.transport.outbox import open_outboxes
from flatland.ros.transport.publisher import Publisher
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.ros_transport import RosTransport

STAMPED = "/flatland_tests/stamped"
PLAIN = "/flatland_tests/plain"
TEXT = "/flatland_tests/text"


def serialized(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def point(number: int) -> PointStamped:
    message = PointStamped()
    message.header.frame_id = "map"
    message.point.x = number
    return message


@pytest.fixture
def advertise(
    registrar: Registrar, ros: Any, eventually: Callable[..., Any]
) -> Iterator[Callable[[str, Any], tuple[Publisher, list[Any]]]]:
    """Advertises a topic and connects two subscribers to it."""
    publishers: list[Publisher] = []

    def connected(topic: str, message_type: Any) -> tuple[Publisher, list[Any]]:
        publisher = Publisher(registrar, topic, message_type, queue_size=100)
        publishers.append(publisher)
        assert registrar.flush(TIMEOUT)
        for count, name in enumerate(("/first", "/second"), 1):
            subscribers.append(RawSubscriber(ros.master, topic, message_type, name=name))
            # One after the other, so that they are listed in this order.
            eventually(
                "the connection",
                lambda count=count: len(publisher._publisher.impl.connections) == count,
            )
        return publisher, subscribers

    subscribers: list[RawSubscriber] = []
    yield connected
    for each in (*subscribers, *publishers):
        each.close()


def test_all_subscribers_receive_serialized_messages(advertise: Any) -> None:
    publisher, subscribers = advertise(PLAIN, Int32)
    for number in range(3):
        publisher.publish_serialized(struct.pack("<i", number))
    for subscriber in subscribers:
        assert [subscriber.next().data for _ in range(3)] == [0, 1, 2]


def test_messages_are_not_delayed_after_disable_delay(advertise: Any, registrar: Registrar) -> None:
    """Nagle's algorithm would hold back small messages beyond the response of step_world."""
    publisher, _ = advertise(PLAIN, Int32)

    def undelayed() -> list[int]:
        connections = publisher._publisher.impl.connections
        option = (socket.IPPROTO_TCP, socket.TCP_NODELAY)
        return [connection.socket.getsockopt(*option) for connection in connections]

    assert undelayed() == [0, 0]
    RosTransport(registrar).disable_delay()
    assert undelayed() == [1, 1]


def test_sequence_numbers_continue_those_of_message_objects(advertise: Any) -> None:
    publisher, subscribers = advertise(STAMPED, PointStamped)
    publisher.publish(point(0))
    publisher.publish_serialized(serialized(point(1)))
    publisher.publish_serialized(serialized(point(2)))
    publisher.publish(point(3))
    for subscriber in subscribers:
        received = [subscriber.next() for _ in range(4)]
        assert [message.point.x for message in received] == [0, 1, 2, 3]
        assert {message.header.frame_id for message in received} == {"map"}
        first = received[0].header.seq
        assert [message.header.seq - first for message in received] == [0, 1, 2, 3]


def test_a_broken_connection_is_closed_and_the_others_receive_the_message(advertise: Any) -> None:
    publisher, subscribers = advertise(PLAIN, Int32)
    first, second = publisher._publisher.impl.connections

    def fail(_data: bytes) -> None:
        raise OSError("broken")

    first.write_data = fail
    publisher.publish_serialized(struct.pack("<i", 7))
    publisher.publish_serialized(struct.pack("<i", 8))
    assert first.done
    assert publisher._publisher.impl.connections == [second]
    assert [subscribers[1].next().data for _ in range(2)] == [7, 8]
    assert subscribers[0].socket.recv(1) == b""


def test_by_default_only_the_newest_message_waits_for_a_slow_subscriber(
    registrar: Registrar, ros: Any
) -> None:
    publisher = Publisher(registrar, TEXT, String)
    assert registrar.flush(TIMEOUT)
    subscriber = RawSubscriber(ros.master, TEXT, String)
    wait_until("the connection", lambda: publisher.connected)
    outbox = next(outbox for outbox in open_outboxes() if outbox.topic == TEXT)
    count = 0
    while outbox.dropped < 3:
        publisher.publish(String(data=f"{count:09d}".ljust(100_000)))
        count += 1
    received = [int(subscriber.next().data) for _ in range(count - 3)]
    subscriber.close()
    publisher.close()
    assert received == [*range(count - 4), count - 1]


def test_a_topic_that_is_closed_and_opened_again_keeps_its_connections(
    advertise: Any, registrar: Registrar
) -> None:
    publisher, subscribers = advertise(PLAIN, Int32)
    connections = publisher._publisher.impl.connections
    with registrar.closing_last():
        publisher.close()
        again = Publisher(registrar, PLAIN, Int32)
    assert registrar.flush(TIMEOUT)
    assert again._publisher.impl.connections == connections
    again.publish(Int32(5))
    assert [subscriber.next().data for subscriber in subscribers] == [5, 5]
    again.close()


def test_a_topic_is_ready_after_its_owner_was_notified(registrar: Registrar, ros: Any) -> None:
    polled, ready = threading.Event(), threading.Event()
    early: list[bool] = []

    def notify(connected: bool) -> None:
        if connected:
            assert polled.wait(TIMEOUT)
            early.append(ready.wait(0.1))

    def is_connected() -> bool:
        polled.set()
        return registrar.is_connected(PLAIN)

    def poll() -> None:
        wait_until("a ready topic", is_connected)
        ready.set()

    publisher = Publisher(registrar, PLAIN, Int32, on_connection=notify)
    assert registrar.flush(TIMEOUT)
    thread = threading.Thread(target=poll)
    subscriber = RawSubscriber(ros.master, PLAIN, Int32)
    thread.start()
    thread.join(TIMEOUT)
    subscriber.close()
    publisher.close()
    assert ready.is_set()
    assert early == [False]


def test_a_closed_publisher_is_freed_while_another_one_has_its_topic(registrar: Registrar) -> None:
    first, second = (Publisher(registrar, PLAIN, Int32, queue_size=1) for _ in range(2))
    assert registrar.flush(TIMEOUT)
    reference = weakref.ref(first)
    first.close()
    assert registrar.flush(TIMEOUT)
    del first
    gc.collect()
    assert reference() is None
    second.close()


def test_nothing_is_serialized_without_subscribers(registrar: Registrar) -> None:
    publisher = Publisher(registrar, "/flatland_tests/alone", Int32)
    calls: list[int] = []

    def serialize() -> bytes:
        calls.append(1)
        return b""

    publisher.publish_serialized(serialize)  # not advertised yet
    assert registrar.flush(TIMEOUT)
    publisher.publish_serialized(serialize)
    publisher.close()
    publisher.publish_serialized(serialize)
    assert registrar.flush(TIMEOUT)
    assert calls == []


def test_a_serialized_message_is_stored_for_a_latched_topic(
    advertise: Any, registrar: Registrar, ros: Any
) -> None:
    """A plugin latches the topic of an output with a publisher of its own."""
    publisher, subscribers = advertise(STAMPED, PointStamped)
    latched = Publisher(registrar, STAMPED, PointStamped, latch=True)
    assert registrar.flush(TIMEOUT)
    publisher.publish_serialized(serialized(point(5)))
    assert [subscriber.next().point.x for subscriber in subscribers] == [5, 5]
    late = RawSubscriber(ros.master, STAMPED, PointStamped, name="/late")
    assert late.next().point.x == 5
    late.close()
    latched.close()
