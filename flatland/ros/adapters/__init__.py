"""Adapters that convert values to ROS messages and back, one per value type.

A built-in adapter is imported when its value type is first used, because importing message packages
slows down the start of the node. Other packages register their own adapters:

    from flatland.ros.adapters import register_adapter
    register_adapter(Temperature, sensor_msgs.msg.Temperature, to_message=make_message)
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

from flatland import values
from flatland.node import values as node_values
from flatland.node.transport import Adapter as Adapter
from flatland.values import OccupancyGrid

_BUILT_IN: dict[str, tuple[type[Any], ...]] = {
    "basic": (
        bool,
        values.People,
        values.PoseStamped,
        values.Transform,
        values.Twist,
        values.TwistWithCovariance,
        node_values.ReceivedPose,
    ),
    "sensors": (
        values.Imu,
        values.JointState,
        values.LaserScan,
        values.NavSatFix,
        values.Range,
    ),
    "nav": (
        values.Odometry,
        OccupancyGrid,
        node_values.MapMetadata,
        node_values.PublishedMap,
    ),
    "own": (
        values.Collisions,
        values.PeopleStates,
        values.SemanticScan,
        node_values.StampedModelStates,
    ),
    "tf": (node_values.FrameParents, node_values.Transforms),
    "ackermann": (values.AckermannCommand,),
    "diagnostics": (node_values.Diagnostics,),
    "people_markers": (values.PeopleMarkers,),
    "tracked_people": (values.TrackedPeople,),
}
_modules = {value_type: name for name, types in _BUILT_IN.items() for value_type in types}
_adapters: dict[type[Any], Adapter] = {}


def register_adapter(
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
        to_message: Converts a value to a new message; called in the thread that steps the world.
            The message is sent at the end of the step. May be omitted if `serialize` is given: the
            message is then the one with the serialized bytes.
        from_message: Converts a message to a value; called in a rospy thread.
        serialize: Converts a value to the bytes of its message, with the sequence number 0 in the
            header. Messages are then published and recorded without creating Python objects for
            their parts.

    Raises:
        ValueError: None of the functions is given.
    """
    if to_message is None and from_message is None and serialize is None:
        raise ValueError(f"an adapter for {value_type.__name__} needs at least one function")
    if to_message is None and serialize is not None:
        pack = serialize

        def to_message(value: Any) -> Any:
            return message_type().deserialize(pack(value))

    _adapters[value_type] = Adapter(value_type, message_type, to_message, from_message, serialize)


def register_built_in(value_type: type[Any], message_type: type[Any], **functions: Any) -> None:
    """Registers an adapter of this package, unless the type has one; see `register_adapter`."""
    if value_type not in _adapters:
        register_adapter(value_type, message_type, **functions)


def find_adapter(value_type: type[Any]) -> Adapter | None:
    """Returns the adapter of a type or of its nearest base class, or None."""
    for candidate in value_type.__mro__:
        if candidate not in _adapters and candidate in _modules:
            importlib.import_module(f"{__name__}.{_modules[candidate]}")
        if candidate in _adapters:
            return _adapters[candidate]
    return None
