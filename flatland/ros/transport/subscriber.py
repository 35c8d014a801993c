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
    """

    def __init__(
        self,
        registrar: Registrar,
        topic: str,
        message_type: type[Any],
        callback: Callable[[Any], object],
        *,
        owner: str = "",
    ) -> None:
        """Subscribes to a topic asynchronously.

        Args:
            registrar: Registers the subscription with the ROS master.
            topic: Name in the namespace of the node, global with a leading `/`.
            message_type: ROS message class.
            callback: Called with each message.
            owner: Plugin that subscribes, for messages.

        Raises:
            FlatlandError: This node subscribes to the topic with another message type.
        """
        self.topic: str = rospy.resolve_name(topic)
        self.owner = owner
        self._registrar = registrar
        self._message_type = message_type
        self._callback = callback
        self._closed = False
        self._subscriber: rospy.Subscriber | None = None
        registrar.claim("subscriber", self.topic, message_type, self)
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
        if self._closed:
            return
        self._closed = True
        self._registrar.release("subscriber", self.topic, self)
        self._registrar.submit_closing(self._end)

    def _receive(self, message: Any) -> None:
        if not self._closed:
            self._callback(message)

    def _open(self) -> None:
        if not self._closed:
            self._subscriber = rospy.Subscriber(self.topic, self._message_type, self._receive)

    def _end(self) -> None:
        if self._subscriber is not None:
            unregister(self._subscriber)
