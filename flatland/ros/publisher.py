"""A publisher that never waits for its subscribers and knows whether it has any."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import rospy

from flatland.errors import FlatlandError
from flatland.ros.outbox import Outbox


class Publisher:
    """Publishes messages on a topic from the thread that steps the world.

    rospy does the registration, the connections and the serialization; only the writing is ours,
    see `outbox`.

    Attributes:
        topic: The resolved name of the topic.
        connected: Whether anybody subscribes.
    """

    def __init__(
        self,
        topic: str,
        message_type: type[Any],
        *,
        queue_size: int = 1,
        latch: bool = False,
        on_connection: Callable[[bool], None] | None = None,
    ) -> None:
        """Advertises a topic.

        Args:
            topic: Under the node's namespace, global with a leading `/`.
            message_type: The ROS message class.
            queue_size: How many messages wait for a subscriber that reads slowly; of more the
                oldest are dropped.
            latch: Whether a new subscriber gets the last message at once.
            on_connection: Told whether anybody subscribes, whenever that may have changed; called
                in a thread of rospy.

        Raises:
            FlatlandError: This node publishes messages of another type on the topic.
        """
        self.connected = False
        self._on_connection = on_connection
        self._queue_size = queue_size
        self._update_lock = threading.Lock()
        # Connections that come before _take_over get rospy's own queue, which does not block
        # either.
        self._publisher = rospy.Publisher(topic, message_type, queue_size=1, latch=latch)
        self.topic: str = self._publisher.resolved_name
        self._impl = self._publisher.impl
        if self._impl.data_class is not message_type:
            actual = self._impl.data_class._type
            self._publisher.unregister()
            raise FlatlandError(
                f'topic "{self.topic}" carries {actual} already, not {message_type._type}'
            )
        self._listener = _Listener(self._update)
        self._take_over()

    def _take_over(self) -> None:
        """Puts an outbox into every connection that is made from now on."""
        impl = self._impl
        if "add_connection" not in vars(impl):  # Publishers of one topic share the connections.
            add_connection = impl.add_connection

            def add_with_outbox(transport: Any) -> bool:
                Outbox(transport, self._queue_size)
                added: bool = add_connection(transport)
                return added

            impl.add_connection = add_with_outbox
            impl.set_queue_size(None)
        impl.add_subscriber_listener(self._listener)
        self._update()

    def _update(self) -> None:
        # The state is read under a lock and not taken from the listener's arguments: a connection
        # that comes and one that goes are told of by two threads, in any order.
        with self._update_lock:
            self.connected = self._impl.has_connections()
            if self._on_connection is not None:
                self._on_connection(self.connected)

    def publish(self, message: Any) -> None:
        """Sends a message to all subscribers; does nothing once closed or at shutdown."""
        try:
            self._publisher.publish(message)
        except rospy.ROSException:
            if not rospy.is_shutdown() and self._publisher.impl is not None:
                raise

    def close(self) -> None:
        """Ends the topic, unless this node has another publisher of it."""
        self._on_connection = None
        self.connected = False
        listeners = self._impl.subscriber_listeners
        if listeners is not None and self._listener in listeners:
            listeners.remove(self._listener)
        self._publisher.unregister()


class _Listener(rospy.SubscribeListener):  # type: ignore[misc]
    """Tells of every connection that comes or goes."""

    def __init__(self, changed: Callable[[], None]) -> None:
        super().__init__()
        self._changed = changed

    def peer_subscribe(self, _topic: str, _publish: Any, _publish_single: Any) -> None:
        """Hears of a new subscriber."""
        self._changed()

    def peer_unsubscribe(self, _topic: str, _num_peers: int) -> None:
        """Hears that a subscriber is gone."""
        self._changed()
