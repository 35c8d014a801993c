"""A subscriber that is registered asynchronously."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import rospy

from flatland.ros.transport.registrar import Registrar, unregister


class Subscriber:
    """Calls a function with each message of a topic, in a rospy thread.

    Attributes:
        topic: Resolved name of the topic.
        owner: Plugin that subscribes, for messages.
        closed: Whether the subscription has ended: it was closed, or has given way.
    """

    def __init__(
        self,
        registrar: Registrar,
        topic: str,
        message_type: type[Any],
        callback: Callable[[Any], object],
        *,
        owner: str = "",
        gives_way: bool = False,
    ) -> None:
        """Subscribes to a topic asynchronously.

        Args:
            registrar: Registers the subscription with the ROS master.
            topic: Name in the namespace of the node, global with a leading `/`.
            message_type: ROS message class.
            callback: Called with each message.
            owner: Plugin that subscribes, for messages.
            gives_way: Whether the subscription ends when another one of this node, which does not
                give way, needs another message class.

        Raises:
            FlatlandError: This node subscribes to the topic with another message type.
        """
        self.topic: str = rospy.resolve_name(topic)
        self.owner = owner
        self._registrar = registrar
        self._message_type = message_type
        self._callback = callback
        self.closed = False
        self._gives_way = gives_way
        self._subscriber: rospy.Subscriber | None = None
        give_way = self._give_way if gives_way else None
        registrar.claim("subscriber", self.topic, message_type, self, give_way=give_way)
        registrar.submit(self._open)

    @property
    def ready(self) -> bool:
        """Whether a publisher has accepted a connection."""
        subscriber = self._subscriber
        impl = subscriber.impl if subscriber is not None else None
        # rospy lists a connection before the publisher accepts it with its header.
        return impl is not None and any(each.header for each in impl.connections)

    def close(self) -> None:
        """Unsubscribes asynchronously; no callback starts after this call."""
        if self.closed:
            return
        self.closed = True
        if self._gives_way:
            # First, because another thread may claim the topic with another class.
            self._registrar.submit(self._end)
            self._registrar.release("subscriber", self.topic, self)
            return
        self._registrar.release("subscriber", self.topic, self)
        self._registrar.submit_closing(self._end)

    def _receive(self, message: Any) -> None:
        if not self.closed:
            self._callback(message)

    def _open(self) -> None:
        if not self.closed:
            self._subscriber = rospy.Subscriber(self.topic, self._message_type, self._receive)

    def _give_way(self) -> None:
        self.closed = True
        self._end()

    def _end(self) -> None:
        subscriber, self._subscriber = self._subscriber, None
        if subscriber is not None:
            unregister(subscriber)
