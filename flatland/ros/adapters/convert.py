"""Conversion of message parts: headers, poses, velocities, covariances."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from std_msgs.msg import Header

from flatland import geometry
from flatland.geometry import DoubleArray, quaternion_from_yaw
from flatland.ros.stamps import set_stamps as set_stamps
from flatland.ros.stamps import stamp as stamp
from flatland.ros.stamps import time as time


def make(message_type: type[Any], *fields: Any) -> Any:
    """Creates a message from all of its fields in order.

    Equivalent to the constructor of the message, but more than twice as fast.
    """
    message = object.__new__(message_type)
    for name, value in zip(message_type.__slots__, fields, strict=True):
        setattr(message, name, value)
    return message


def header(stamp: int, frame_id: str) -> Header:
    """Creates a header; rospy sets the sequence number."""
    return make(Header, 0, time(stamp), frame_id)


def quaternion(yaw: float, roll: float = 0.0) -> Quaternion:
    """Creates the rotation about x by `roll` followed by the rotation about z by `yaw` [rad]."""
    return make(Quaternion, *quaternion_from_yaw(yaw, roll))


def pose(x: float, y: float, yaw: float) -> Pose:
    """Creates a planar pose."""
    return make(Pose, make(Point, x, y, 0.0), quaternion(yaw))


def twist(linear_x: float, linear_y: float, angular_z: float) -> Twist:
    """Creates a planar velocity."""
    return make(Twist, make(Vector3, linear_x, linear_y, 0.0), make(Vector3, 0.0, 0.0, angular_z))


def covariance(matrix: DoubleArray) -> Sequence[float]:
    """Flattens a square matrix in row-major order."""
    numbers: list[float] = matrix.ravel().tolist()
    return numbers


def planar_pose(message: Pose) -> geometry.Pose | None:
    """Converts a message to (x, y, theta); None for non-finite numbers or a zero quaternion."""
    position, q = message.position, message.orientation
    numbers = (position.x, position.y, position.z, q.x, q.y, q.z, q.w)
    if not all(map(math.isfinite, numbers)) or not any((q.x, q.y, q.z, q.w)):
        return None
    return (position.x, position.y, geometry.yaw_from_quaternion(q.x, q.y, q.z, q.w))
