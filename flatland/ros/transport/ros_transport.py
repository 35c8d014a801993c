"""The connections of the node by rospy."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final
from weakref import WeakKeyDictionary

import rospy
from rosgraph_msgs.msg import Clock
from rospy import rostime

from flatland.node.transport import MARKERS, Adapter, OnConnection, Transport
from flatland.ros.message_types import service_class
from flatland.ros.transport.outbox import Outbox, open_outboxes
from flatland.ros.transport.publisher import Publisher
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.service import Service, fields_service
from flatland.ros.transport.state_topic import StateTopic
from flatland.ros.transport.subscriber import Subscriber
from flatland.timekeeper import NANOSECONDS

if TYPE_CHECKING:
    from flatland.node.adapters.writer import Writer
    from flatland.node.handles import Handles, HandleServer
    from flatland.node.ticker import TickerThread
    from flatland.node.transport import Connection, ForeignTopicsConnection, MessageFile
    from flatland.runtime.requests import Post
    from flatland.simulation import Simulation
    from flatland.world import World

_CLOCK: Final = "/clock"
_TIME: Final = struct.Struct("<2I")


class RosTransport(Transport):
    """Publishes, subscribes and serves; registration takes place in the thread of a registrar."""

    REGISTER_ADAPTER = "flatland.ros.adapters.register_adapter"

    def __init__(self, registrar: Registrar) -> None:
        """Uses a registrar, which must outlive the transport.

        Args:
            registrar: Makes the calls to the ROS master.
        """
        self._registrar = registrar

    # -- topics and services ---------------------------------------------------------------

    def find_adapter(self, value_type: type[Any]) -> Adapter | None:
        """Returns the adapter of a value type or of its nearest base class, or None."""
        from flatland.ros.adapters import find_adapter

        return find_adapter(value_type)

    def message_class(self, name: str) -> type[Any]:
        """Imports a message class."""
        from flatland.ros.adapters import message_class

        return message_class(name)

    def writer(self) -> Writer:
        """Returns a writer for a new message."""
        from flatland.ros.adapters.writer import RosWriter

        return RosWriter()

    def advertise(self, *arguments: Any, **options: Any) -> Publisher:
        """Advertises a topic."""
        return Publisher(self._registrar, *arguments, **options)

    def advertise_state(self, *arguments: Any, **options: Any) -> StateTopic:
        """Advertises a state."""
        return StateTopic(self._registrar, *arguments, **options)

    def subscribe(self, *arguments: Any, **options: Any) -> Subscriber:
        """Calls a function with each message of a topic, in a rospy thread."""
        return Subscriber(self._registrar, *arguments, **options)

    def serve(
        self,
        name: str,
        service_type: type[Any] | str,
        handler: Callable[[Any], Any],
        *,
        owner: str = "",
    ) -> Service:
        """Calls a function with each request of a service, each in a thread of its own."""
        if isinstance(service_type, str):
            service_type, handler = fields_service(service_type, handler)
        return Service(self._registrar, name, service_type, handler, owner=owner)

    def service_class(self, name: str) -> type[Any]:
        """Returns the class of a service of flatland."""
        return service_class(name)

    # -- the node --------------------------------------------------------------------------

    @property
    def node_name(self) -> str:
        """Resolved name of the node."""
        return str(rospy.get_name())

    @property
    def shutting_down(self) -> bool:
        """Whether rospy is shutting down."""
        return bool(rospy.core.is_shutdown_requested())

    def resolve(self, name: str) -> str:
        """Returns the global name after remapping."""
        return str(rospy.resolve_name(name))

    def parameter(self, name: str) -> Any:
        """Returns a parameter in the namespace of the node, None if it is not set."""
        return rospy.get_param(name, None)

    def set_parameter(self, name: str, value: object) -> None:
        """Sets a parameter asynchronously; without a master, as soon as there is one."""
        self._registrar.set_parameter(name, value)

    def flush(self, timeout: float) -> bool:
        """Waits until everything queued so far is registered; not while the master is lost."""
        return self._registrar.flush(timeout)

    def is_connected(self, topic: str) -> bool:
        """Returns whether all publishers and subscribers of this node for a topic are connected."""
        return self._registrar.is_connected(self.resolve(topic))

    def closing_last(self) -> AbstractContextManager[None]:
        """Closes topics after those that are opened in the block."""
        return self._registrar.closing_last()

    def dropped(self) -> Callable[[], Counter[tuple[str, str]]]:
        """Returns a function that counts dropped messages by topic and subscriber."""
        seen: WeakKeyDictionary[Outbox, int] = WeakKeyDictionary()

        def count() -> Counter[tuple[str, str]]:
            dropped: Counter[tuple[str, str]] = Counter()
            for outbox in open_outboxes():
                number = outbox.dropped
                # Most connections never drop a message and need no entry.
                if number and number > (before := seen.get(outbox, 0)):
                    dropped[outbox.topic, outbox.subscriber] += number - before
                    seen[outbox] = number
            return dropped

        return count

    def disable_delay(self) -> None:
        """Sends small messages of all connections at once from now on."""
        for outbox in open_outboxes():
            outbox.disable_delay()

    def record(self, path: str, world: World) -> MessageFile:
        """Records all messages of a world to an MCAP file."""
        from flatland.ros.message_recorder import record_mcap

        recorder = record_mcap(path, ends_on_error=True)
        recorder.observe(world)
        return recorder

    # -- time ------------------------------------------------------------------------------

    def clock_topic(
        self, now: Callable[[], int], post: Post, on_connection: OnConnection
    ) -> _ClockTopic:
        """Advertises `/clock`."""
        return _ClockTopic(self._registrar, now, post, on_connection)

    def set_time(self, time_ns: int) -> None:
        """Sets the value of `rospy.get_rostime` and wakes the threads that sleep in ROS time.

        Equivalent to the callback of rospy for `/clock`, but without its copy and its deprecation
        warning, which cost more than a physics step.
        """
        now: rospy.Time = object.__new__(rospy.Time)
        now.secs, now.nsecs = divmod(time_ns, NANOSECONDS)
        rostime._rostime_current = now
        changed = rostime.get_rostime_cond()
        with changed:
            if changed._waiters:
                changed.notify_all()

    # -- displays --------------------------------------------------------------------------

    def load_debug_markers(
        self,
    ) -> Callable[[Simulation, float, TickerThread], Connection]:
        """Imports the debug markers."""
        from flatland.node.markers.debug_topics import DebugTopics

        self.message_class(MARKERS)
        return partial(DebugTopics, self)

    def load_handle_server(self) -> Callable[[Post, Handles], HandleServer]:
        """Imports the server of interactive markers."""
        from flatland.ros.interactive.marker_server import MarkerServer

        return partial(MarkerServer, self._registrar)

    def load_foreign_topics(self) -> Callable[[Simulation], ForeignTopicsConnection]:
        """Imports the topics of other nodes for the viewer in the browser."""
        from flatland.node.foreign_topics.topics import RosTopics
        from flatland.ros.graph import Graph

        return partial(RosTopics, self, Graph(self.node_name))


class _ClockTopic(StateTopic):
    """Publishes the time at the moment of serialization.

    All messages of a topic are serialized one after the other, so that no subscriber receives a
    time that is earlier than the previous one, whichever thread publishes it.
    """

    def __init__(
        self, registrar: Registrar, now: Callable[[], int], post: Post, on_connection: OnConnection
    ) -> None:
        def packed() -> bytes:
            return _TIME.pack(*divmod(now(), NANOSECONDS))

        class CurrentTime(Clock):  # type: ignore[misc]
            """The current time; a message for a new subscriber is serialized under the lock."""

            def serialize(self, buff: BytesIO) -> None:
                """Writes the message; called by rospy."""
                buff.write(packed())

        self._packed = packed
        super().__init__(registrar, _CLOCK, Clock, CurrentTime, post, on_connection)

    def send(self) -> None:
        """Publishes the current time; safe from any thread."""
        self.publish_serialized(self._packed)
