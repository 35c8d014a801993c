"""A transport without ROS: messages are the values themselves."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest
from waiting import TIMEOUT

from flatland.node.clock import SimulatedClock
from flatland.node.parameters import read_parameters
from flatland.node.served_world import ServedWorld
from flatland.node.transport import Adapter, Transport
from flatland.web.foreign_topics import TopicDemand, TopicUpdate


class FakeTopic:
    """A topic whose subscriber is the test; also a subscription or a service.

    Attributes:
        sent: The published values.
        options: With what it was opened.
    """

    def __init__(
        self,
        name: str,
        make: Any = None,
        post: Any = None,
        on_connection: Any = None,
        **options: Any,
    ) -> None:
        self.topic = name
        self.options = options
        self.connected = False
        self.sent: list[Any] = []
        self.closed = False
        self._make, self._post, self._on_connection = make, post, on_connection

    def connect(self) -> None:
        """Adds a subscriber, which receives the current state."""
        self.connected = True
        if self._on_connection is not None:
            self._on_connection(True)
        if self._make is not None:
            self._post(lambda: self.sent.append(self._make()))

    def disconnect(self) -> None:
        """Removes the subscriber."""
        self.connected = False
        self._on_connection(False)

    def send(self) -> None:
        if self.connected:
            self.sent.append(self._make())

    def publish(self, message: Any) -> None:
        if self.connected:
            self.sent.append(message)

    def close(self) -> None:
        self.closed = True


class FakeForeignTopics:
    """No topics of other nodes."""

    closed = False

    def update(self, demand: TopicDemand) -> TopicUpdate:
        return TopicUpdate()

    def suspend(self) -> None:
        pass

    def publish_pose(self, kind: str, topic: str, pose: Any) -> bool:
        return False

    def close(self) -> None:
        self.closed = True


class FakeTransport(Transport):
    """Connects the node to a test.

    Attributes:
        topics: Published topics by name.
        callbacks: Callbacks of subscriptions by name of the topic.
        subscriptions: All subscriptions, in their order.
        services: Handlers by name of the service.
        parameters: Parameters by name.
        lost: Messages that were dropped, by topic and subscriber.
        is_delayed: Whether the system may delay small messages.
        registers: Whether registrations are complete in time.
        flushed: Limits of the waits for registrations [s].
        foreign_topics: Topics of other nodes for the viewer in the browser.
    """

    REGISTER_ADAPTER = "register"
    node_name = "/flatland_server"
    shutting_down = False
    is_delayed = True
    registers = True

    def __init__(self) -> None:
        self.topics: dict[str, FakeTopic] = {}
        self.callbacks: dict[str, Callable[[Any], object]] = {}
        self.subscriptions: list[FakeTopic] = []
        self.services: dict[str, Callable[[Any], Any]] = {}
        self.parameters: dict[str, object] = {}
        self.lost: Counter[tuple[str, str]] = Counter()
        self.flushed: list[float] = []
        self.time_ns = 0
        self.foreign_topics = FakeForeignTopics()

    def find_adapter(self, value_type: type[Any]) -> Adapter:
        return Adapter(value_type, value_type, lambda value: value, lambda message: message)

    def message_class(self, name: str) -> type[Any]:
        return type(name.partition("/")[2], (), {})

    def writer(self) -> Any:
        raise NotImplementedError

    def _add(self, topic: str, *arguments: Any, **options: Any) -> FakeTopic:
        self.topics[topic] = FakeTopic(topic, *arguments, **options)
        return self.topics[topic]

    def advertise(self, topic: str, message_type: type[Any], **options: Any) -> FakeTopic:
        return self._add(topic, type=message_type, **options)

    def advertise_state(
        self, topic: str, message_type: Any, make: Any, post: Any, on_connection: Any = None
    ) -> FakeTopic:
        return self._add(topic, make, post, on_connection)

    def subscribe(self, topic: str, message_type: Any, callback: Any, **options: Any) -> FakeTopic:
        self.callbacks[topic] = callback
        self.subscriptions.append(FakeTopic(topic, type=message_type, **options))
        return self.subscriptions[-1]

    def serve(self, name: str, service_type: Any, handler: Any, **options: Any) -> FakeTopic:
        self.services[name] = handler
        return FakeTopic(name, type=service_type, **options)

    def call(self, service: str, **fields: Any) -> SimpleNamespace:
        """Calls a service."""
        return SimpleNamespace(**self.services[service](SimpleNamespace(**fields)))

    def service_class(self, name: str) -> type[Any]:
        return type(name, (), {})

    def resolve(self, name: str) -> str:
        return name if name.startswith("/") else f"/{name}"

    def parameter(self, name: str) -> Any:
        return self.parameters.get(name)

    def set_parameter(self, name: str, value: object) -> None:
        self.parameters[name] = value

    def flush(self, timeout: float) -> bool:
        self.flushed.append(timeout)
        return self.registers

    def is_connected(self, topic: str) -> bool:
        return self.topics[topic].connected

    def closing_last(self) -> Any:
        return nullcontext()

    def dropped(self) -> Any:
        def count() -> Counter[tuple[str, str]]:
            lost, self.lost = self.lost, Counter()
            return lost

        return count

    def disable_delay(self) -> None:
        self.is_delayed = False

    def record(self, path: str, world: Any) -> FakeTopic:
        return self._add(path)

    def clock_topic(self, now: Any, post: Any, on_connection: Any) -> FakeTopic:
        return self._add("/clock", now, post, on_connection)

    def set_time(self, time_ns: int) -> None:
        self.time_ns = time_ns

    def load_debug_markers(self) -> Any:
        return []

    def load_foreign_topics(self) -> Any:
        return lambda _simulation: self.foreign_topics

    def load_handle_server(self) -> Any:
        raise ImportError("there are no interactive markers here")


class Node:
    """A node that runs in a thread.

    Attributes:
        transport: Its connections.
        served: Its world.
        world: The same.
        close: Ends the node; idempotent.
    """

    def __init__(
        self, transport: FakeTransport, served: ServedWorld, close: Callable[[], None]
    ) -> None:
        self.transport = transport
        self.served = served
        self.world = served.world
        self.call = transport.call
        self.close = close

    def run(self, action: Callable[[], Any]) -> Any:
        """Runs an action between two steps and returns its result."""
        return self.served.simulation.post(action).result(TIMEOUT)


@pytest.fixture
def transport() -> FakeTransport:
    return FakeTransport()


@pytest.fixture
def serve(files: Any, transport: FakeTransport) -> Iterator[Callable[..., Node]]:
    """Starts a node with the text of a world file and parameters."""
    ends: list[Callable[[], None]] = []

    def start(text: str = "{properties: {}, layers: [{name: 2d}]}", **parameters: Any) -> Node:
        path = files.write("world.yaml", text)
        given = read_parameters({"world_path": path, "seed": 1, **parameters}.get)
        clock = SimulatedClock(transport, given.clock_rate)
        served = ServedWorld(given, transport, clock)
        thread = threading.Thread(target=served.run)
        thread.start()

        def end() -> None:
            served.simulation.stop()
            thread.join(TIMEOUT)
            served.close()

        ends.append(end)
        return Node(transport, served, end)

    yield start
    for end in ends:
        end()
