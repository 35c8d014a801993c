"""Parts that many messages have: headers, poses, velocities, covariances."""

from __future__ import annotations

import math
from collections.abc import Sequence

from genpy import Time
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from std_msgs.msg import Header

from flatland.timekeeper import NANOSECONDS
from flatland.values import DoubleArray


def time(nanoseconds: int) -> Time:
    """Makes a ROS time from simulated nanoseconds, exactly."""
    return Time(*divmod(nanoseconds, NANOSECONDS))


def header(stamp: int, frame_id: str) -> Header:
    """Makes a header; rospy numbers the messages."""
    return Header(0, time(stamp), frame_id)


def quaternion(yaw: float, roll: float = 0.0) -> Quaternion:
    """Makes the rotation that rolls about x first and then turns about z [rad]."""
    sin_yaw, cos_yaw = math.sin(yaw / 2), math.cos(yaw / 2)
    if roll == 0.0:
        return Quaternion(0.0, 0.0, sin_yaw, cos_yaw)
    sin_roll, cos_roll = math.sin(roll / 2), math.cos(roll / 2)
    return Quaternion(
        sin_roll * cos_yaw, sin_roll * sin_yaw, cos_roll * sin_yaw, cos_roll * cos_yaw
    )


def pose(x: float, y: float, yaw: float) -> Pose:
    """Makes a pose in the plane."""
    return Pose(Point(x, y, 0.0), quaternion(yaw))


def twist(linear_x: float, linear_y: float, angular_z: float) -> Twist:
    """Makes a velocity in the plane."""
    return Twist(Vector3(linear_x, linear_y, 0.0), Vector3(0.0, 0.0, angular_z))


def covariance(matrix: DoubleArray) -> Sequence[float]:
    """Writes a square matrix row by row."""
    numbers: list[float] = matrix.ravel().tolist()
    return numbers
