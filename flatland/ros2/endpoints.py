"""The publishers, subscriptions and services of the node, several users of a name sharing one.

All connections are opened and closed at once; other nodes discover them in the background.
"""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Iterator
from typing import Any, TypeVar, cast

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile

from flatland.errors import FlatlandError
from flatland.node.transport import OnConnection
from flatland.ros2 import qos
from flatland.ros2.message_types import type_name
from flatland.runtime.requests import Post

_LOG = logging.getLogger("flatland")

Key = tuple[str, str]
"""Kind and resolved name of a connection."""
S = TypeVar("S", bound="Shared")


class Endpoints:
    """The connections of a node, by kind and name.

    Attributes:
        node: The node.
        reliable_sensors: Whether measurements of sensors are published reliably.
    """

    def __init__(self, node: Node, *, reliable_sensors: bool = False) -> None:
        """Creates a table without connections.

        Args:
            node: The node.
            reliable_sensors: Whether measurements of sensors are published reliably.
        """
        self.node = node
        self.reliable_sensors = reliable_sensors
        self._lock = threading.RLock()
        self._shared: dict[Key, Shared] = {}
        self._postponed: list[Shared] | None = None

    def join(
        self, kind: str, name: str, ros_type: type[Any], user: User, create: Callable[[], S]
    ) -> S:
        """Adds a user to the connection of a name, which is created for the first one.

        Args:
            kind: `publisher`, `subscriber` or `service`.
            name: Resolved name.
            ros_type: Message or service class.
            user: What uses the name.
            create: Creates the connection.

        Raises:
            FlatlandError: The name has another type, is not legal, or is that of a service.
        """
        with self._lock:
            shared = self._shared.get((kind, name))
            if shared is not None and shared.type is not ros_type and not user.gives_way:
                shared = self._remove_those_that_give_way(shared)
            if shared is not None:
                owner = next((each.owner for each in shared.users), "")
                used_by = f", used by {owner}" if owner else ""
                if shared.type is not ros_type:
                    raise FlatlandError(
                        f'{kind} "{name}" has the type {type_name(shared.type)} already{used_by}, '
                        f"not {type_name(ros_type)}"
                    )
                if kind == "service" and shared.users:
                    raise FlatlandError(f'{kind} "{name}" exists already{used_by}')
                shared.users.append(user)
            else:
                shared = create()
                # First, so that it receives what arrives at once.
                shared.users.append(user)
                try:
                    shared.open()
                except ValueError as error:  # of rclpy, for a name or a type
                    raise FlatlandError(f'cannot open {kind} "{name}": {error}') from error
                self._shared[kind, name] = shared
            return cast(S, shared)  # Each kind has one class.

    def _remove_those_that_give_way(self, shared: Shared) -> Shared | None:
        """Ends a connection unless one of its users does not give way; returns what remains."""
        if not all(user.gives_way for user in shared.users):
            return shared
        for user in shared.users:
            user.closed = True
        shared.users.clear()
        self._end_unused(shared)
        return None

    def leave(self, shared: Shared, user: User) -> None:
        """Removes a user; the connection ends with the last one, see also `closing_last`."""
        with self._lock:
            if user not in shared.users:
                return
            shared.users.remove(user)
            if self._postponed is not None:
                self._postponed.append(shared)
            else:
                self._end_unused(shared)

    @contextlib.contextmanager
    def closing_last(self) -> Iterator[None]:
        """Closes connections that are unused at the end of the block, and not opened again.

        To be used in the thread that steps the world.
        """
        self._postponed = []
        try:
            yield
        finally:
            with self._lock:
                postponed, self._postponed = self._postponed, None
                for shared in postponed:
                    self._end_unused(shared)

    def _end_unused(self, shared: Shared) -> None:
        if not shared.users and self._shared.get(shared.key) is shared:
            del self._shared[shared.key]
            shared.destroy()

    def is_connected(self, topic: str) -> bool:
        """Returns whether all publishers and subscriptions of the node for a topic are connected.

        Args:
            topic: Resolved name; a topic that this node does not use is not connected.
        """
        with self._lock:
            found = [self._shared.get((kind, topic)) for kind in ("publisher", "subscriber")]
        used = [shared for shared in found if shared is not None]
        return bool(used) and all(shared.connections > 0 for shared in used)


class User:
    """A user of a connection.

    Attributes:
        owner: Plugin that uses it, for messages; empty for the node itself.
        gives_way: Whether the use ends when a user that does not give way needs another type.
        closed: Whether the use has ended.
    """

    def __init__(self, owner: str, *, gives_way: bool = False) -> None:
        """Creates a user of nothing."""
        self.owner = owner
        self.gives_way = gives_way
        self.closed = False


class Shared:
    """A publisher, subscription or service of rclpy.

    Attributes:
        key: Its kind and resolved name.
        type: Message or service class.
        users: What uses it.
        connections: Number of matching connections of other nodes.
    """

    def __init__(self, kind: str, name: str, ros_type: type[Any]) -> None:
        """Creates a connection without users."""
        self.key = kind, name
        self.type = ros_type
        self.users: list[Any] = []
        self.connections = 0

    def open(self) -> None:
        """Opens the connection."""
        raise NotImplementedError

    def destroy(self) -> None:
        """Ends the connection."""
        raise NotImplementedError


class _SharedPublisher(Shared):
    """A publisher of rclpy."""

    def __init__(
        self, node: Node, topic: str, resolved: str, message_type: type[Any], profile: QoSProfile
    ) -> None:
        super().__init__("publisher", resolved, message_type)
        self._node = node
        self._topic = topic  # which rclpy resolves
        self._profile = profile
        self._lock = threading.RLock()  # of the publisher and the number of its subscribers
        self._has_sent = False
        self._refused: set[str] = set()  # texts that were logged
        self._publisher: Any = None

    def open(self) -> None:
        """Advertises the topic; a subscriber that connects at once is counted afterwards."""
        with self._lock:
            self._publisher = self._create()

    def _create(self) -> Any:
        return self._node.create_publisher(
            self.type,
            self._topic,
            self._profile,
            event_callbacks=PublisherEventCallbacks(
                matched=self._matched, incompatible_qos=self._incompatible
            ),
        )

    def publish(self, message: Any) -> None:
        """Sends a message, or its bytes."""
        with self._lock:
            if self._publisher is not None:
                self._has_sent = True
                self._publisher.publish(message)

    def forget(self) -> None:
        """Discards the messages that would be sent to new subscribers, if there are none then."""
        with self._lock:
            if self._publisher is not None and self._has_sent and not self.connections:
                destroy_later(self._node, self._node.destroy_publisher, self._publisher)
                self._has_sent = False
                self._publisher = self._create()

    def destroy(self) -> None:
        """Ends the topic."""
        with self._lock:
            publisher, self._publisher = self._publisher, None
            self.connections = 0
        destroy_later(self._node, self._node.destroy_publisher, publisher)

    def _matched(self, info: Any) -> None:
        """Counts the subscribers; called by the executor."""
        with self._lock:
            if self._publisher is None:
                return
            self.connections = info.current_count
            users = list(self.users)
        for user in users:
            user.update(connected=info.current_count > 0, new=info.current_count_change > 0)

    def _incompatible(self, _info: Any) -> None:
        """Logs subscribers that receive nothing; called by the executor."""
        topic = self.key[1]
        for text in qos.refused(self._node.get_subscriptions_info_by_topic(topic), self._profile):
            if text not in self._refused:
                self._refused.add(text)
                _LOG.warning('topic "%s": %s', topic, text)


class Publisher(User):
    """Publishes messages on a topic without blocking.

    Attributes:
        topic: Resolved name of the topic.
        connected: Whether the topic has subscribers.
    """

    def __init__(
        self,
        endpoints: Endpoints,
        topic: str,
        message_type: type[Any],
        *,
        queue_size: int = 1,
        latch: bool = False,
        on_connection: OnConnection | None = None,
        owner: str = "",
        gives_way: bool = False,
        profile: QoSProfile | None = None,
    ) -> None:
        """Advertises a topic.

        Args:
            endpoints: The connections of the node.
            topic: Name in the namespace of the node, global with a leading `/`.
            message_type: ROS message class.
            queue_size: Number of messages kept for a slow subscriber, at least.
            latch: Whether a new subscriber receives the last message when it connects.
            on_connection: Called by the executor whenever subscribers have connected or
                disconnected, with whether there are any.
            owner: Plugin that publishes, for messages.
            gives_way: See `User`.
            profile: Quality of service; None for that of `qos`.

        Raises:
            FlatlandError: This node publishes messages of another type on the topic, or its name
                is not legal.
        """
        super().__init__(owner, gives_way=gives_way)
        self.topic = resolve_topic(endpoints.node, topic)
        self.connected = False
        self._endpoints = endpoints
        self._on_connection = on_connection
        if profile is None:
            profile = qos.of_publisher(
                message_type, queue_size, latch=latch, reliable_sensors=endpoints.reliable_sensors
            )
        self._shared = endpoints.join(
            "publisher",
            self.topic,
            message_type,
            self,
            lambda: _SharedPublisher(
                endpoints.node, expanded(topic), self.topic, message_type, profile
            ),
        )
        if self._shared.connections:
            self.update(connected=True, new=True)

    @property
    def connections(self) -> int:
        """Number of subscribers that are connected."""
        return int(self._shared.connections)

    def publish(self, message: Any) -> None:
        """Sends a message, or its bytes, to all subscribers; has no effect once closed."""
        if not self.closed:
            self._shared.publish(message)

    def update(self, *, connected: bool, new: bool) -> None:  # noqa: ARG002
        """Reports a change of the subscribers.

        Args:
            connected: Whether there are subscribers.
            new: Whether there is a new subscriber.
        """
        if not self.closed:
            self.connected = connected
            if self._on_connection is not None:
                self._on_connection(self.connected)

    def close(self) -> None:
        """Ends the topic, unless this node has another publisher of it."""
        if not self.closed:
            self.closed = True
            self.connected = False
            self._endpoints.leave(self._shared, self)


class StateTopic(Publisher):
    """Publishes a state: to new subscribers when they connect, to all when it changes.

    Messages are created on demand, and not at all without subscribers. When the last subscriber has
    gone, the stored message is discarded, so that a late subscriber never receives an old state.
    """

    def __init__(
        self,
        endpoints: Endpoints,
        topic: str,
        message_type: type[Any],
        make: Callable[[], Any],
        post: Post,
        on_connection: OnConnection | None = None,
        *,
        profile: QoSProfile = qos.STATE,
    ) -> None:
        """Advertises a topic.

        Args:
            endpoints: The connections of the node.
            topic: Name in the namespace of the node, private with a leading `~`.
            message_type: ROS message class.
            make: Creates the message of the current state, as an object or as its bytes; called
                between two steps.
            post: Runs an action between two steps.
            on_connection: See `Publisher`.
            profile: Quality of service.

        Raises:
            FlatlandError: See `Publisher`.
        """
        self._make = make
        self._post = post
        super().__init__(
            endpoints, topic, message_type, on_connection=on_connection, profile=profile
        )

    def send(self) -> None:
        """Publishes the current state; must be called in the thread that steps the world."""
        if self.connected:
            self.publish(self._make())

    def replace(self, make: Callable[[], Any]) -> None:
        """Publishes another state from now on; must be called in the thread that steps the world.

        Args:
            make: Creates the message of the new state, as the argument of the constructor.
        """
        self._make = make
        self.send()

    def update(self, *, connected: bool, new: bool) -> None:
        """Schedules a message to a new subscriber."""
        super().update(connected=connected, new=new)
        if not self.closed:
            self._post(self.send if new else lambda: self._shared.forget())


class Subscription(User):
    """Calls a function with each message of a topic, in the thread of the executor.

    Attributes:
        topic: Resolved name of the topic.
    """

    def __init__(
        self,
        endpoints: Endpoints,
        topic: str,
        message_type: type[Any],
        callback: Callable[[Any], object],
        *,
        owner: str = "",
        gives_way: bool = False,
    ) -> None:
        """Subscribes to a topic.

        Args:
            endpoints: The connections of the node.
            topic: Name in the namespace of the node, global with a leading `/`.
            message_type: ROS message class.
            callback: Called with each message.
            owner: Plugin that subscribes, for messages.
            gives_way: See `User`.

        Raises:
            FlatlandError: This node subscribes to the topic with another message type, or its name
                is not legal.
        """
        super().__init__(owner, gives_way=gives_way)
        self.topic = resolve_topic(endpoints.node, topic)
        self._endpoints = endpoints
        self._callback = callback
        self._shared = endpoints.join(
            "subscriber",
            self.topic,
            message_type,
            self,
            lambda: _SharedSubscription(
                endpoints.node, expanded(topic), self.topic, message_type, for_viewer=gives_way
            ),
        )

    def receive(self, message: Any) -> None:
        """Passes a message on."""
        if not self.closed:
            self._callback(message)

    def close(self) -> None:
        """Unsubscribes; no callback starts after this call."""
        if not self.closed:
            self.closed = True
            self._endpoints.leave(self._shared, self)


class _SharedSubscription(Shared):
    """A subscription of rclpy."""

    def __init__(
        self, node: Node, topic: str, resolved: str, message_type: type[Any], *, for_viewer: bool
    ) -> None:
        super().__init__("subscriber", resolved, message_type)
        self._node = node
        self._topic = topic  # which rclpy resolves
        self._profile = qos.of_subscription(resolved, message_type)
        if for_viewer and resolved != qos.STATIC_TRANSFORMS:
            self._profile = qos.of_viewer(node.get_publishers_info_by_topic(resolved))
        self._subscription: Any = None

    def open(self) -> None:
        """Subscribes."""
        self._subscription = self._node.create_subscription(
            self.type,
            self._topic,
            self._receive,
            self._profile,
            event_callbacks=SubscriptionEventCallbacks(matched=self._matched),
        )

    def destroy(self) -> None:
        """Unsubscribes."""
        self.connections = 0
        destroy_later(self._node, self._node.destroy_subscription, self._subscription)

    def _receive(self, message: Any) -> None:
        for user in list(self.users):
            try:
                user.receive(message)
            except Exception:
                _LOG.exception("cannot handle a message on %s", self.key[1])

    def _matched(self, info: Any) -> None:
        self.connections = info.current_count


def destroy_later(node: Node, destroy: Callable[[Any], object], connection: Any) -> None:
    """Destroys a connection in the thread of the executor, which may be waiting for it otherwise.

    Args:
        node: The node.
        destroy: The method of the node that destroys the connection.
        connection: The publisher, subscription or service; destroyed at once if the executor does
            not run yet.
    """
    executor = node.executor
    if executor is None:
        destroy(connection)
    else:
        executor.create_task(destroy, connection)


def resolve_topic(node: Node, name: str) -> str:
    """Returns the global name of a topic after remapping.

    Raises:
        FlatlandError: The name is not legal.
    """
    try:
        return str(node.resolve_topic_name(expanded(name)))
    except ValueError as error:
        raise FlatlandError(f'illegal name of a topic, "{name}": {error}') from error


def expanded(name: str) -> str:
    """Returns a private name in the form of ROS 2, `~/name`."""
    return f"~/{name[1:]}" if name.startswith("~") and not name.startswith("~/") else name
