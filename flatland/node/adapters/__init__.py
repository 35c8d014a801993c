"""Conversion between values and messages, which ROS 1 and ROS 2 share.

Messages are written field by field into bytes, see `writer`. The modules of message packages are
imported when a type of values is first used, because their import slows down the start of the node.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import wraps
from typing import Any, Final

from flatland import values
from flatland.node import values as node_values
from flatland.node.adapters.receivers import RECEIVERS
from flatland.node.adapters.serializers import SERIALIZERS, Serialize
from flatland.node.adapters.writer import Writer
from flatland.node.parameters import OWN_PACKAGE
from flatland.node.transport import Adapter

MESSAGE_TYPES: Final[dict[type[Any], str]] = {
    bool: "std_msgs/Bool",
    values.AckermannCommand: "ackermann_msgs/AckermannDriveStamped",
    values.Collisions: f"{OWN_PACKAGE}/Collisions",
    values.Imu: "sensor_msgs/Imu",
    values.JointState: "sensor_msgs/JointState",
    values.LaserScan: "sensor_msgs/LaserScan",
    values.NavSatFix: "sensor_msgs/NavSatFix",
    values.OccupancyGrid: "nav_msgs/OccupancyGrid",
    values.Odometry: "nav_msgs/Odometry",
    values.People: "geometry_msgs/PoseArray",
    values.PeopleMarkers: "visualization_msgs/MarkerArray",
    values.PeopleStates: f"{OWN_PACKAGE}/PeopleStates",
    values.PoseStamped: "geometry_msgs/PoseStamped",
    values.Range: "sensor_msgs/Range",
    values.SemanticScan: f"{OWN_PACKAGE}/SemanticScan",
    values.TrackedPeople: "people_msgs/People",
    values.Transform: "geometry_msgs/TransformStamped",
    values.Twist: "geometry_msgs/Twist",
    values.TwistWithCovariance: "geometry_msgs/TwistWithCovarianceStamped",
    node_values.DebugTopicNames: f"{OWN_PACKAGE}/DebugTopicList",
    node_values.Diagnostics: "diagnostic_msgs/DiagnosticArray",
    node_values.FrameParents: "tf2_msgs/TFMessage",
    node_values.MapMetadata: "nav_msgs/MapMetaData",
    node_values.PublishedMap: "nav_msgs/OccupancyGrid",
    node_values.ReceivedPose: "geometry_msgs/PoseWithCovarianceStamped",
    node_values.StampedModelStates: f"{OWN_PACKAGE}/ModelStates",
    node_values.Transforms: "tf2_msgs/TFMessage",
}
"""The message of each type of values, `PACKAGE/NAME`, with the package `flatland` for the own."""


class Adapters(ABC):
    """The adapters of one kind of ROS: those of `MESSAGE_TYPES`, and those that are registered."""

    def __init__(self, writer: Callable[[], Writer]) -> None:
        """Creates the table.

        Args:
            writer: Creates the writer of a message.
        """
        self._writer = writer
        self._adapters: dict[type[Any], Adapter] = {}

    @abstractmethod
    def message_class(self, name: str) -> type[Any]:
        """Imports a message class, `PACKAGE/NAME` as in `MESSAGE_TYPES`.

        Raises:
            ImportError: The package is not installed.
        """

    @abstractmethod
    def deserialize(self, message_type: type[Any], data: bytes) -> Any:
        """Returns a serialized message as an object."""

    def register(
        self,
        value_type: type[Any],
        message_type: type[Any],
        to_message: Callable[[Any], Any] | None = None,
        from_message: Callable[[Any], Any] | None = None,
        serialize: Callable[[Any], bytes] | None = None,
    ) -> None:
        """Registers the conversion between the values of a type and ROS messages.

        A later registration replaces an earlier one for the same type.

        Args:
            value_type: Type of the values carried by the ports of a plugin.
            message_type: ROS message class.
            to_message: Converts a value to a new message; called in the thread that steps the
                world. The message is sent at the end of the step. May be omitted if `serialize` is
                given: the message is then the one with the serialized bytes.
            from_message: Converts a message to a value; called in any thread.
            serialize: Converts a value to the bytes of its message, with the sequence number 0 in
                the header of ROS 1. Messages are then published and recorded without creating
                Python objects for their parts.

        Raises:
            ValueError: None of the functions is given.
        """
        if to_message is None and from_message is None and serialize is None:
            raise ValueError(f"an adapter for {value_type.__name__} needs at least one function")
        if to_message is None and serialize is not None:
            pack = serialize

            def to_message(value: Any) -> Any:
                return self.deserialize(message_type, pack(value))

        self._adapters[value_type] = Adapter(
            value_type, message_type, to_message, from_message, serialize
        )

    def find(self, value_type: type[Any]) -> Adapter | None:
        """Returns the adapter of a type or of its nearest base class, or None.

        Raises:
            ImportError: The message package is not installed.
        """
        for candidate in value_type.__mro__:
            if candidate not in self._adapters and candidate in MESSAGE_TYPES:
                write = SERIALIZERS.get(candidate)
                self.register(
                    candidate,
                    self.message_class(MESSAGE_TYPES[candidate]),
                    from_message=RECEIVERS.get(candidate),
                    serialize=None if write is None else self._serializer(write),
                )
            if candidate in self._adapters:
                return self._adapters[candidate]
        return None

    def field(self, field_type: str, value: Any) -> Any:
        """Returns a value as a field of a message: unchanged, or as the message of its adapter.

        Args:
            field_type: Type of the field, for the error.
            value: A bool, an int, a str, or a value with an adapter.

        Raises:
            LookupError: There is no adapter that publishes such values.
        """
        if isinstance(value, (bool, int, str)):
            return value
        adapter = self.find(type(value))
        if adapter is None or adapter.to_message is None:
            raise LookupError(f"no adapter converts {type(value).__name__} to {field_type}")
        return adapter.to_message(value)

    def _serializer(self, write: Serialize) -> Callable[[Any], bytes]:
        """Returns the function that converts a value to bytes."""
        writer = self._writer

        @wraps(write)  # for messages about the adapter
        def serialize(value: Any) -> bytes:
            to = writer()
            write(value, to)
            return bytes(to.data)

        return serialize
