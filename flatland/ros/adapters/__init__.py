"""Adapters that convert values to ROS messages and back, one per value type.

A built-in adapter is imported when its value type is first used, because importing message packages
slows down the start of the node. Other packages register their own adapters:

    from flatland.ros.adapters import register_adapter
    register_adapter(Temperature, sensor_msgs.msg.Temperature, to_message=make_message)
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flatland import values

_BUILT_IN: dict[type[Any], str] = {
    bool: "boolean",
    values.AckermannCommand: "ackermann",
    values.Collisions: "collisions",
    values.Imu: "imu",
    values.JointState: "joint_state",
    values.LaserScan: "laser_scan",
    values.NavSatFix: "nav_sat_fix",
    values.Odometry: "odometry",
    values.PoseStamped: "pose_stamped",
    values.Range: "range",
    values.SemanticScan: "semantic_scan",
    values.People: "people",
    values.PeopleMarkers: "people_markers",
    values.PeopleStates: "people_states",
    values.TrackedPeople: "tracked_people",
    values.Transform: "transform",
    values.Twist: "twist",
    values.TwistWithCovariance: "twist_with_covariance",
}


@dataclass(frozen=True, slots=True)
class Adapter:
    """Conversion between the values of one type and ROS messages.

    Attributes:
        value_type: Type of the values.
        message_type: The ROS message class.
        to_message: Converts a value to a message; None if values are only received.
        from_message: Converts a message to a value; None if values are only published.
        serialize: Converts a value to a serialized message; None to serialize the result of
            `to_message`.
    """

    value_type: type[Any]
    message_type: type[Any]
    to_message: Callable[[Any], Any] | None
    from_message: Callable[[Any], Any] | None
    serialize: Callable[[Any], bytes] | None = None


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
            The message is sent at the end of the step.
        from_message: Converts a message to a value; called in a rospy thread.
        serialize: Converts a value to the bytes that `serialize` of the message of `to_message`
            writes, with the sequence number 0 in the header. Messages are then published without
            creating Python objects for their parts; `to_message` is used by recorders only.

    Raises:
        ValueError: Neither `to_message` nor `from_message` is given, or `serialize` is given
            without `to_message`.
    """
    if to_message is None and from_message is None:
        raise ValueError(f"an adapter for {value_type.__name__} needs at least one function")
    if serialize is not None and to_message is None:
        raise ValueError(f"an adapter for {value_type.__name__} needs to_message for serialize")
    _adapters[value_type] = Adapter(value_type, message_type, to_message, from_message, serialize)


def find_adapter(value_type: type[Any]) -> Adapter | None:
    """Returns the adapter of a type or of its nearest base class, or None."""
    for candidate in value_type.__mro__:
        if candidate not in _adapters and candidate in _BUILT_IN:
            importlib.import_module(f"{__name__}.{_BUILT_IN[candidate]}")
        if candidate in _adapters:
            return _adapters[candidate]
    return None
