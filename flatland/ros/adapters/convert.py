"""Parts that many messages have: headers, poses, velocities, covariances."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from genpy import Time
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from std_msgs.msg import Header

from flatland.geometry import DoubleArray
from flatland.timekeeper import NANOSECONDS


def make(message_type: type[Any], *fields: Any) -> Any:
    """Makes a message from all of its fields in order.

    As the message's own constructor does, in less than half of the time.
    """
    message = object.__new__(message_type)
    for name, value in zip(message_type.__slots__, fields, strict=True):
        setattr(message, name, value)
    return message


def time(nanoseconds: int, time_type: type[Time] = Time) -> Time:
    """Makes a ROS time from simulated nanoseconds, exactly; also past its constructor."""
    result: Time = object.__new__(time_type)
    result.secs, result.nsecs = divmod(nanoseconds, NANOSECONDS)
    return result


def header(stamp: int, frame_id: str) -> Header:
    """Makes a header; rospy numbers the messages."""
    return make(Header, 0, time(stamp), frame_id)


def quaternion(yaw: float, roll: float = 0.0) -> Quaternion:
    """Makes the rotation that rolls about x first and then turns about z [rad]."""
    sin_yaw, cos_yaw = math.sin(yaw / 2), math.cos(yaw / 2)
    if roll == 0.0:
        return make(Quaternion, 0.0, 0.0, sin_yaw, cos_yaw)
    sin_roll, cos_roll = math.sin(roll / 2), math.cos(roll / 2)
    return make(
        Quaternion, sin_roll * cos_yaw, sin_roll * sin_yaw, cos_roll * sin_yaw, cos_roll * cos_yaw
    )


def pose(x: float, y: float, yaw: float) -> Pose:
    """Makes a pose in the plane."""
    return make(Pose, make(Point, x, y, 0.0), quaternion(yaw))


def twist(linear_x: float, linear_y: float, angular_z: float) -> Twist:
    """Makes a velocity in the plane."""
    return make(Twist, make(Vector3, linear_x, linear_y, 0.0), make(Vector3, 0.0, 0.0, angular_z))


def covariance(matrix: DoubleArray) -> Sequence[float]:
    """Writes a square matrix row by row."""
    numbers: list[float] = matrix.ravel().tolist()
    return numbers
