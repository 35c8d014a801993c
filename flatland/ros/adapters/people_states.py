"""`PeopleStates` as the message `PeopleStates` of the selected package."""

from typing import Any

from geometry_msgs.msg import Pose2D

from flatland.ros.adapters import convert, register_adapter
from flatland.ros.message_types import message_class
from flatland.values import PeopleStates

_PeopleStates = message_class("PeopleStates")


def to_message(value: PeopleStates) -> Any:
    """Converts a value to a message."""
    return _PeopleStates(
        convert.header(value.stamp, value.frame_id),
        list(value.names),
        list(value.groups),
        [Pose2D(x, y, yaw) for x, y, yaw in value.poses.tolist()],
        [convert.twist(vx, vy, omega) for vx, vy, omega in value.velocities.tolist()],
        value.standing.tolist(),
    )


register_adapter(PeopleStates, _PeopleStates, to_message)
