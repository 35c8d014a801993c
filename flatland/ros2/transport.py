"""The connections of the node by rclpy."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from rclpy.clock import Clock as NodeTime
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from flatland.node.clock import warn_of_other_clocks
from flatland.node.ticker import Ticker
from flatland.node.transport import MARKERS, Adapter, OnConnection, Transport
from flatland.ros2 import qos, ros_time
from flatland.ros2.endpoints import (
    Endpoints,
    Publisher,
    StateTopic,
    Subscription,
    destroy_later,
    resolve_topic,
)
from flatland.ros2.message_types import message_class, service_class
from flatland.ros2.parameters import DeclaredParameters
from flatland.ros2.service import Service, fields_service
from flatland.ros2.writer import CdrWriter
from flatland.timekeeper import NANOSECONDS

if TYPE_CHECKING:
    from flatland.node.ticker import TickerThread
    from flatland.node.transport import Connection, ForeignTopicsConnection, MessageFile
    from flatland.runtime.requests import Post
    from flatland.simulation import Simulation
    from flatland.world import World

_CLOCK: Final = "/clock"
_CLOCK_CHECK_PERIOD: Final = 2.0  # s of wall time between two searches for other publishers
_CLOCK_REPETITIONS: Final = 5.0  # s of wall time after a new subscriber
_CLOCK_REPETITION_RATE: Final = 10.0  # Hz


class Ros2Transport(Transport):
    """Publishes, subscribes and serves; callbacks run in the thread of an executor."""

    REGISTER_ADAPTER = "flatland.ros2.adapters.register_adapter"

    def __init__(
        self,
        node: Node,
        parameters: DeclaredParameters,
        *,
        reliable_sensors: bool,
        is_stopping: Callable[[], bool],
    ) -> None:
        """Uses a node, which must outlive the transport.

        Args:
            node: The node, which an executor runs in another thread.
            parameters: Its parameters.
            reliable_sensors: Whether measurements of sensors are published reliably.
            is_stopping: Returns whether a stop was requested.
        """
        self._node = node
        self._is_stopping = is_stopping
        self._parameters = parameters
        self._clock = node.get_clock()
        self._endpoints = Endpoints(node, reliable_sensors=reliable_sensors)
        self._has_ended = False

    def shut_down(self) -> None:
        """Refuses further requests, because the simulation has ended."""
        self._has_ended = True

    # -- topics and services ---------------------------------------------------------------

    def find_adapter(self, value_type: type[Any]) -> Adapter | None:
        """Returns the adapter of a value type or of its nearest base class, or None."""
        from flatland.ros2.adapters import find_adapter

        return find_adapter(value_type)

    def message_class(self, name: str) -> type[Any]:
        """Imports a message class."""
        return message_class(name)

    def writer(self) -> CdrWriter:
        """Returns a writer for a new message."""
        return CdrWriter()

    def advertise(self, *arguments: Any, **options: Any) -> Publisher:
        """Advertises a topic."""
        return Publisher(self._endpoints, *arguments, **options)

    def advertise_state(self, *arguments: Any, **options: Any) -> StateTopic:
        """Advertises a state."""
        return StateTopic(self._endpoints, *arguments, **options)

    def subscribe(self, *arguments: Any, **options: Any) -> Subscription:
        """Calls a function with each message of a topic, in the thread of the executor."""
        return Subscription(self._endpoints, *arguments, **options)

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
        return Service(self._endpoints, name, service_type, handler, owner=owner)

    def service_class(self, name: str) -> type[Any]:
        """Returns the class of a service of flatland."""
        return service_class(f"flatland/{name}")

    # -- the node --------------------------------------------------------------------------

    @property
    def node(self) -> Node:
        """The node, for what only ROS 2 has."""
        return self._node

    @property
    def node_name(self) -> str:
        """Resolved name of the node."""
        return str(self._node.get_fully_qualified_name())

    @property
    def shutting_down(self) -> bool:
        """Whether a stop was requested, or the simulation has ended."""
        return self._has_ended or self._is_stopping()

    def resolve(self, name: str) -> str:
        """Returns the global name after remapping."""
        return resolve_topic(self._node, name)

    def parameter(self, name: str) -> Any:
        """Returns a parameter of the node, None if it is not set.

        The parameters of ROS 2 belong to nodes: a global name is taken in the namespace of the
        node, and slashes become dots.
        """
        for prefix in (self.node_name, self._node.get_namespace()):
            name = name.removeprefix(prefix.rstrip("/") + "/")
        return self._parameters.get(name.lstrip("~/"))

    def set_parameter(self, name: str, value: object) -> None:
        """Sets a parameter of the node."""
        self._parameters.set(name.lstrip("~/"), value)

    def flush(self, timeout: float) -> bool:  # noqa: ARG002
        """Returns True: connections are opened at once."""
        return True

    def is_connected(self, topic: str) -> bool:
        """Returns whether all publishers and subscribers of this node for a topic are connected."""
        return self._endpoints.is_connected(self.resolve(topic))

    def closing_last(self) -> AbstractContextManager[None]:
        """Closes topics after those that are opened in the block."""
        return self._endpoints.closing_last()

    def dropped(self) -> Callable[[], Counter[tuple[str, str]]]:
        """Returns a function that counts no messages: DDS does not report dropped ones."""
        return Counter

    def disable_delay(self) -> None:
        """Has no effect: DDS sends each message at once."""

    def record(self, path: str, world: World) -> MessageFile:
        """Records all messages of a world to an MCAP file."""
        from flatland.ros2.message_recorder import record_mcap

        recorder = record_mcap(path, ends_on_error=True)
        recorder.observe(world)
        return recorder

    # -- time ------------------------------------------------------------------------------

    def clock_topic(
        self, now: Callable[[], int], post: Post, on_connection: OnConnection
    ) -> ClockTopic:
        """Advertises `/clock`."""
        return ClockTopic(self._endpoints, now, post, on_connection)

    def set_time(self, time_ns: int) -> None:
        """Sets the ROS time of the node [ns], also of its clock of rclpy."""
        ros_time.set_now(time_ns)
        self._clock.set_ros_time_override(Time(nanoseconds=time_ns, clock_type=ClockType.ROS_TIME))

    # -- displays --------------------------------------------------------------------------

    def load_debug_markers(
        self,
    ) -> Callable[[Simulation, float, TickerThread], Connection]:
        """Imports the debug markers."""
        from flatland.node.markers.debug_topics import DebugTopics

        self.message_class(MARKERS)
        return partial(DebugTopics, self)

    def load_handle_server(self) -> None:
        """Returns None: interactive markers are not offered."""

    def load_foreign_topics(self) -> Callable[[Simulation], ForeignTopicsConnection]:
        """Imports the topics of other nodes for the viewer in the browser."""
        from flatland.node.foreign_topics.topics import RosTopics
        from flatland.ros2.graph import Graph

        return partial(RosTopics, self, Graph(self._node))


class ClockTopic(StateTopic):
    """Publishes the time.

    Subscribers of `/clock` do not ask for lost messages, and one that has just been discovered may
    not have discovered this node yet. The time is therefore repeated for some time after each new
    subscriber, so that also a node that starts while the world is paused has a valid time.
    """

    def __init__(
        self, endpoints: Endpoints, now: Callable[[], int], post: Post, on_connection: OnConnection
    ) -> None:
        """Advertises the topic.

        Args:
            endpoints: The connections of the node.
            now: Returns the current time [ns]; called in any thread.
            post: Runs an action at once, one at a time.
            on_connection: See `Publisher`.
        """
        self._now = now
        self._sending = threading.Lock()
        self._repeat_until = 0.0  # time.monotonic
        self._repetition = Ticker("flatland-clock-start", _CLOCK_REPETITION_RATE, post, self._tick)
        super().__init__(
            endpoints, _CLOCK, Clock, self._message, post, on_connection, profile=qos.CLOCK
        )
        self._node = endpoints.node
        self._known: set[str] = set()  # other publishers
        self._check = self._node.create_timer(
            _CLOCK_CHECK_PERIOD, self._find_others, clock=NodeTime(clock_type=ClockType.STEADY_TIME)
        )

    def send(self) -> None:
        """Publishes the current time; of several threads, none sends an earlier one."""
        with self._sending:
            super().send()

    def update(self, *, connected: bool, new: bool) -> None:
        """Sends the time to new subscribers, and repeats it."""
        Publisher.update(self, connected=connected, new=new)
        if new and not self.closed:
            self._repeat_until = time.monotonic() + _CLOCK_REPETITIONS
            self._repetition.wake()

    def close(self) -> None:
        """Ends the topic."""
        self._repetition.close()
        destroy_later(self._node, self._node.destroy_timer, self._check)
        super().close()

    def _find_others(self) -> None:
        """Logs a warning about other publishers of the time; called by the executor."""
        own = self._node.get_fully_qualified_name()
        names = [
            f"{each.node_namespace.rstrip('/')}/{each.node_name}"
            for each in self._node.get_publishers_info_by_topic(self.topic)
            if each.node_name != qos.UNKNOWN_NODE
        ]
        if own in names:
            names.remove(own)  # Several nodes may have one name.
        others = set(names) - self._known
        if others:
            self._known |= others
            warn_of_other_clocks(self.topic, sorted(others))

    def _message(self) -> bytes:
        to = CdrWriter()
        to.stamp(*divmod(self._now(), NANOSECONDS))
        return bytes(to.data)

    def _tick(self, now: float) -> bool:
        self.send()
        return now < self._repeat_until
