"""A publisher that never waits: not for subscribers, and not for the ROS master."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import rospy

from flatland.ros.registrar import Registrar
from flatland.ros.transport.outbox import Outbox


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
        registrar: Registrar,
        topic: str,
        message_type: type[Any],
        *,
        queue_size: int = 1,
        latch: bool = False,
        on_connection: Callable[[bool], None] | None = None,
        owner: str = "",
    ) -> None:
        """Advertises a topic, soon.

        Args:
            registrar: Talks to the ROS master.
            topic: Under the node's namespace, global with a leading `/`.
            message_type: The ROS message class.
            queue_size: How many messages wait for a subscriber that reads slowly; of more the
                oldest are dropped.
            latch: Whether a new subscriber gets the last message at once.
            on_connection: Told whether anybody subscribes, whenever that may have changed; called
                in a thread of rospy.
            owner: Plugin that publishes, for messages.

        Raises:
            FlatlandError: This node publishes messages of another type on the topic.
        """
        self.topic: str = rospy.resolve_name(topic)
        self.connected = False
        self._registrar = registrar
        self._message_type = message_type
        self._queue_size = queue_size
        self._latch = latch
        self._on_connection = on_connection
        self._owner = owner
        self._closed = False
        self._publisher: rospy.Publisher | None = None
        self._early_message: Any = None
        # Neither is held while rospy's own locks may be waited for in another order.
        self._early_lock = threading.Lock()
        self._update_lock = threading.Lock()
        self._listener = _Listener(self._update)
        registrar.claim("publisher", self.topic, message_type, owner)
        registrar.submit(self._open)

    def publish(self, message: Any) -> None:
        """Sends a message to all subscribers; does nothing once closed or at shutdown."""
        if self._closed:
            return
        publisher = self._publisher
        if publisher is None:
            # Not advertised yet: there is nobody, but a later subscriber may want it.
            with self._early_lock:
                publisher = self._publisher
                if publisher is None:
                    self._early_message = message if self._latch else None
                    return
        try:
            publisher.publish(message)
        except Exception:
            # At shutdown rospy takes its topics apart in another thread.
            if not rospy.core.is_shutdown_requested():
                raise

    def close(self) -> None:
        """Ends the topic, soon, unless this node has another publisher of it."""
        if self._closed:
            return
        self._closed = True
        self._update()
        self._registrar.release("publisher", self.topic, self._owner)
        self._registrar.submit(self._end)

    # -- in the registrar's thread ---------------------------------------------------------

    def _open(self) -> None:
        if self._closed:
            return
        # Connections that come before `_take_over` get rospy's own queue, which does not block
        # either.
        publisher = rospy.Publisher(self.topic, self._message_type, queue_size=1, latch=self._latch)
        self._take_over(publisher.impl)
        with self._early_lock:
            self._publisher = publisher
            if self._early_message is not None:
                publisher.publish(self._early_message)
                self._early_message = None
        self._update()

    def _take_over(self, impl: Any) -> None:
        """Puts an outbox into every connection that is made from now on."""
        if "add_connection" not in vars(impl):  # Publishers of one topic share the connections.
            add_connection = impl.add_connection

            def add_with_outbox(transport: Any) -> bool:
                Outbox(transport, self._queue_size)
                added: bool = add_connection(transport)
                return added

            impl.add_connection = add_with_outbox
            impl.set_queue_size(None)
        impl.add_subscriber_listener(self._listener)

    def _end(self) -> None:
        publisher, self._publisher = self._publisher, None
        if publisher is None or publisher.impl is None:
            return
        listeners = publisher.impl.subscriber_listeners
        if listeners is not None and self._listener in listeners:
            listeners.remove(self._listener)
        publisher.unregister()

    # -- in rospy's threads ----------------------------------------------------------------

    def _update(self) -> None:
        # The state is read under a lock and not taken from the listener's arguments: a connection
        # that comes and one that goes are told of by two threads, in any order.
        with self._update_lock:
            publisher = self._publisher
            impl = publisher.impl if publisher is not None else None
            connected = not self._closed and impl is not None and impl.has_connections()
            self.connected = connected
            if self._on_connection is not None:
                self._on_connection(connected)


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
