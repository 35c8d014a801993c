"""How values become ROS messages and back: one adapter a value type.

The included adapters are imported when their type is first used, since every message package that
is imported makes the start of the node slower. Other packages register their own:

    from flatland.ros.adapters import register_adapter
    register_adapter(Temperature, sensor_msgs.msg.Temperature, to_message=make_message)
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flatland import values

_INCLUDED: dict[type[Any], str] = {
    bool: "boolean",
    values.Collisions: "collisions",
    values.Imu: "imu",
    values.LaserScan: "laser_scan",
    values.NavSatFix: "nav_sat_fix",
    values.Odometry: "odometry",
    values.Transform: "transform",
    values.Twist: "twist",
    values.TwistWithCovariance: "twist_with_covariance",
}


@dataclass(frozen=True, slots=True)
class Adapter:
    """How values of one type become messages and back.

    Attributes:
        value_type: Type of the values.
        message_type: The ROS message class.
        to_message: Makes a message from a value; None when values of this type are only taken.
        from_message: Makes a value from a message; None when they are only published.
    """

    value_type: type[Any]
    message_type: type[Any]
    to_message: Callable[[Any], Any] | None
    from_message: Callable[[Any], Any] | None


_adapters: dict[type[Any], Adapter] = {}


def register_adapter(
    value_type: type[Any],
    message_type: type[Any],
    to_message: Callable[[Any], Any] | None = None,
    from_message: Callable[[Any], Any] | None = None,
) -> None:
    """Says how values of a type are published, and how messages become such values.

    A second adapter for the same type takes the place of the first.

    Args:
        value_type: Type of the values that a plugin's ports carry.
        message_type: The ROS message class.
        to_message: Makes a message from a value; called in the thread that steps the world.
        from_message: Makes a value from a message; called in a thread of rospy.

    Raises:
        ValueError: Both functions are left out.
    """
    if to_message is None and from_message is None:
        raise ValueError(f"an adapter for {value_type.__name__} needs at least one function")
    _adapters[value_type] = Adapter(value_type, message_type, to_message, from_message)


def find_adapter(value_type: type[Any]) -> Adapter | None:
    """Returns the adapter of a type or of its nearest base class, None when there is none."""
    for candidate in value_type.__mro__:
        if candidate not in _adapters and candidate in _INCLUDED:
            importlib.import_module(f"{__name__}.{_INCLUDED[candidate]}")
        if candidate in _adapters:
            return _adapters[candidate]
    return None
