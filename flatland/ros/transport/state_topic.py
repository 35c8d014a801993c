"""A topic for a state: each new subscriber receives a message created on demand."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import rospy

from flatland.ros.transport.publisher import Publisher, SerializedMessage
from flatland.ros.transport.registrar import Registrar
from flatland.runtime.requests import Post

_LOG = logging.getLogger("flatland")


class StateTopic(Publisher):
    """Publishes a state: to new subscribers when they connect, to all when it changes.

    Unlike a latched topic of rospy, it stores no message, so that a late subscriber never receives
    an outdated one. Messages are created on demand, and not at all without subscribers.
    """

    def __init__(
        self,
        registrar: Registrar,
        topic: str,
        message_type: type[Any],
        make: Callable[[], Any],
        post: Post,
        on_connection: Callable[[bool], object] | None = None,
    ) -> None:
        """Advertises a topic asynchronously.

        Args:
            registrar: Registers the topic with the ROS master.
            topic: Name in the namespace of the node, private with a leading `~`.
            message_type: ROS message class.
            make: Creates the message of the current state, as an object or as its bytes; called
                between two steps.
            post: Runs an action between two steps.
            on_connection: Called in a rospy thread whenever a subscriber may have connected or
                disconnected, with whether there are subscribers.

        Raises:
            FlatlandError: This node publishes messages of another type on the topic.
        """
        self._make = make
        self._post = post
        self._new_subscribers: list[Callable[[Any], None]] = []
        super().__init__(registrar, topic, message_type, latch=True, on_connection=on_connection)

    def send(self) -> None:
        """Publishes the current state; must be called in the thread that steps the world."""
        if self.connected:
            # A subscriber that connects from here on is added again; at worst it receives the
            # message twice.
            self._new_subscribers.clear()
            self.publish(self._make())

    def replace(self, make: Callable[[], Any]) -> None:
        """Publishes another state from now on; must be called in the thread that steps the world.

        Args:
            make: Creates the message of the new state, as the argument of the constructor.
        """
        self._make = make
        self.send()

    def _connection_changed(self, publish_single: Callable[[Any], None] | None) -> None:
        """Schedules a message to a new subscriber; called in a rospy thread."""
        # `connected` is set first; otherwise, `send` could skip a change of the state that follows
        # the first message to a new subscriber.
        super()._connection_changed(publish_single)
        if publish_single is not None:
            self._new_subscribers.append(publish_single)
            self._post(self._serve_new_subscribers)

    def _serve_new_subscribers(self) -> None:
        if self.closed or not self._new_subscribers:
            return
        try:
            message = self._make()
            if isinstance(message, bytes):
                message = SerializedMessage(message)
            while self._new_subscribers:
                self._publish_single(self._new_subscribers.pop(), message)
        except Exception:
            _LOG.exception("cannot publish to a new subscriber of %s", self.topic)

    def _publish_single(self, publish: Callable[[Any], None], message: Any) -> None:
        publisher = self._publisher
        impl = publisher.impl if publisher is not None else None
        if impl is None:
            return
        impl.acquire()
        try:
            publish(message)
        except rospy.ROSException:
            # The topic was closed in the meantime, by its owner or by a shutdown.
            if not self.closed and not rospy.core.is_shutdown_requested():
                raise
        finally:
            impl.release()

    # -- in the registrar's thread ---------------------------------------------------------

    def _open(self) -> None:
        super()._open()
        if self.connected:
            # Subscribers that connected before `_take_over`, or to another publisher of this node.
            self._post(self.send)

    def _take_over(self, impl: Any) -> None:
        # The topic is announced as latched, but rospy must not store a message: late subscribers
        # would receive an outdated one.
        impl.add_headers({"latching": "1"})
        impl.is_latch = False
        super()._take_over(impl)
