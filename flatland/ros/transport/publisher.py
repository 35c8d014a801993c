"""A publisher that blocks neither on subscribers nor on the ROS master."""

from __future__ import annotations

import logging
import struct
import threading
from collections.abc import Callable
from typing import Any, Final

import rospy

from flatland.ros.transport.outbox import Outbox
from flatland.ros.transport.registrar import Registrar, unregister

_LOG = logging.getLogger("flatland")

_SIZE: Final = struct.Struct("<I")
_SIZE_AND_SEQUENCE: Final = struct.Struct("<II")
_MAX_SEQUENCE: Final = 0xFFFF_FFFF


class Publisher:
    """Publishes messages on a topic from the thread that steps the world.

    rospy registers and connects; the writes to sockets are replaced, see
    `outbox`. Messages are serialized by rospy, or passed as bytes.

    Attributes:
        topic: Resolved name of the topic.
        owner: Plugin that publishes, for messages.
        connected: Whether the topic has subscribers.
        closed: Whether the topic was closed, or has given way.
    """

    def __init__(
        self,
        registrar: Registrar,
        topic: str,
        message_type: type[Any],
        *,
        queue_size: int = 1,
        latch: bool = False,
        on_connection: Callable[[bool], object] | None = None,
        owner: str = "",
        gives_way: bool = False,
    ) -> None:
        """Advertises a topic asynchronously.

        Args:
            registrar: Registers the topic with the ROS master.
            topic: Name in the namespace of the node, global with a leading `/`.
            message_type: ROS message class.
            queue_size: Maximum number of messages queued for a slow subscriber; beyond it, the
                oldest ones are dropped.
            latch: Whether a new subscriber receives the last message when it connects.
            on_connection: Called in a rospy thread whenever a subscriber may have connected or
                disconnected, with whether there are subscribers.
            owner: Plugin that publishes, for messages.
            gives_way: Whether the topic is closed when another publisher of this node, which does
                not give way, needs another message class.

        Raises:
            FlatlandError: This node publishes messages of another type on the topic.
        """
        self.topic: str = rospy.resolve_name(topic)
        self.owner = owner
        self.connected = False
        self._registrar = registrar
        self._message_type = message_type
        self._has_header: bool = message_type._has_header
        self._queue_size = queue_size
        self._latch = latch
        self._on_connection = on_connection
        self.closed = False
        self._gives_way = gives_way
        self._publisher: rospy.Publisher | None = None
        self._early_message: Any = None  # latched message of a topic that is not advertised yet
        # Two locks, because rospy calls `_update` while it holds locks of its own: with one lock,
        # `publish` of an early message could deadlock with a new connection.
        self._early_lock = threading.Lock()
        self._update_lock = threading.Lock()
        self._listener = _ConnectionListener(self._connection_changed)
        give_way = self._give_way if gives_way else None
        registrar.claim("publisher", self.topic, message_type, self, give_way=give_way)
        registrar.submit(self._open)

    @property
    def ready(self) -> bool:
        """Whether there are subscribers, of which the owner of the topic has been notified."""
        with self._update_lock:
            return self.connected

    @property
    def connections(self) -> int:
        """Number of subscribers that are connected."""
        publisher = self._publisher
        return 0 if publisher is None else int(publisher.get_num_connections())

    def publish(self, message: Any) -> None:
        """Sends a message to all subscribers; has no effect once closed or during a shutdown.

        Args:
            message: The message, or its bytes, see `publish_serialized`.
        """
        if isinstance(message, bytes):
            self.publish_serialized(message)
            return
        if self.closed:
            return
        publisher = self._publisher
        if publisher is None:
            # Not advertised yet, so there are no subscribers; only a latched message is needed.
            with self._early_lock:
                publisher = self._publisher
                if publisher is None:
                    self._early_message = message if self._latch else None
                    return
        try:
            publisher.publish(message)
        except Exception:
            # During a shutdown, rospy closes its topics in another thread.
            if not rospy.core.is_shutdown_requested():
                raise

    def publish_serialized(self, message: bytes | Callable[[], bytes]) -> None:
        """Sends a serialized message to all subscribers, if the topic is advertised.

        Args:
            message: The serialized message, with any sequence number in its header. Or a function
                that returns it, called while no other thread publishes on the topic; not called
                without subscribers, unless the topic is latched.
        """
        publisher = self._publisher
        impl: Any = publisher.impl if publisher is not None else None
        lock = getattr(impl, "publock", None)  # None once rospy has closed the topic
        if self.closed or lock is None:
            return
        broken = []
        with lock:
            connections = impl.connections
            if impl.closed or not (connections or impl.is_latch):
                return
            if not isinstance(message, bytes):
                message = message()
            impl.seq += 1
            if self._has_header:
                sequence = impl.seq & _MAX_SEQUENCE
                data = _SIZE_AND_SEQUENCE.pack(len(message), sequence) + message[_SIZE.size :]
            else:
                data = _SIZE.pack(len(message)) + message
            if impl.is_latch:  # because of another publisher of the topic
                impl.latch = SerializedMessage(data[_SIZE.size :])
            for connection in connections:
                try:
                    connection.write_data(data)
                except Exception as error:
                    broken.append(connection)
                    _LOG.debug("%s: connection closed: %s", self.topic, error)
            impl.message_data_sent += len(data)
        for connection in broken:
            connection.close()

    def close(self) -> None:
        """Unregisters the topic asynchronously, unless this node has another publisher of it."""
        if self.closed:
            return
        self.closed = True
        self._update()
        if self._gives_way:
            # First, because another thread may claim the topic with another class.
            self._registrar.submit(self._end)
            self._registrar.release("publisher", self.topic, self)
            return
        self._registrar.release("publisher", self.topic, self)
        self._registrar.submit_closing(self._end)

    # -- in the registrar's thread ---------------------------------------------------------

    def _give_way(self) -> None:
        self.closed = True
        self._end()
        self._update()

    def _open(self) -> None:
        if self.closed:
            return
        # Connections accepted before `_take_over` use the queue of rospy, which does not block
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
        """Creates an outbox for each further connection, and observes the connections."""
        if "add_connection" not in vars(impl):  # Publishers of one topic share the connections.
            # Without `self`: the publisher may be closed before the others of its topic.
            add_connection, queue_size = impl.add_connection, self._queue_size

            def add_with_outbox(transport: Any) -> bool:
                Outbox(transport, queue_size)
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
        unregister(publisher)

    # -- in rospy's threads ----------------------------------------------------------------

    def _connection_changed(self, _publish_single: Callable[[Any], None] | None) -> None:
        """Handles a new connection, with the function that publishes to it alone, or its end."""
        self._update()

    def _update(self) -> None:
        # The state is read under a lock instead of taken from the arguments of the listener,
        # because two threads report a new and a closed connection in any order.
        with self._update_lock:
            publisher = self._publisher
            impl = publisher.impl if publisher is not None else None
            connected = not self.closed and impl is not None and impl.has_connections()
            self.connected = connected
            if self._on_connection is not None:
                self._on_connection(connected)


class SerializedMessage:
    """A serialized message that rospy stores or sends like a message object."""

    def __init__(self, data: bytes) -> None:
        """Stores the bytes, which rospy writes without a change of the sequence number."""
        self._data = data

    def serialize(self, buff: Any) -> None:
        """Writes the message; called by rospy."""
        buff.write(self._data)


class _ConnectionListener(rospy.SubscribeListener):  # type: ignore[misc]
    """Reports every new and every closed connection."""

    def __init__(self, on_change: Callable[[Callable[[Any], None] | None], None]) -> None:
        super().__init__()
        self._on_change = on_change

    def peer_subscribe(
        self, _topic: str, _publish: Any, publish_single: Callable[[Any], None]
    ) -> None:
        """Reports a new subscriber; called by rospy."""
        self._on_change(publish_single)

    def peer_unsubscribe(self, _topic: str, _num_peers: int) -> None:
        """Reports a closed connection; called by rospy."""
        self._on_change(None)
