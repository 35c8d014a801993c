"""Conversion of message parts: stamps, headers, poses."""

from __future__ import annotations

import math

from genpy import Time
from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import Header

from flatland import geometry
from flatland.geometry import quaternion_from_yaw
from flatland.node.clock import stamp as stamp
from flatland.timekeeper import NANOSECONDS


def time(nanoseconds: int) -> Time:
    """Converts simulated nanoseconds to the ROS time of a stamp without rounding."""
    return Time(*divmod(stamp(nanoseconds), NANOSECONDS))


def header(stamp: int, frame_id: str) -> Header:
    """Creates a header; rospy sets the sequence number."""
    return Header(0, time(stamp), frame_id)


def quaternion(yaw: float) -> Quaternion:
    """Creates the rotation about z by `yaw` [rad]."""
    return Quaternion(*quaternion_from_yaw(yaw))


def pose(x: float, y: float, yaw: float) -> Pose:
    """Creates a planar pose."""
    return Pose(Point(x, y, 0.0), quaternion(yaw))


def planar_pose(message: Pose) -> geometry.Pose | None:
    """Converts a message to (x, y, theta); None for non-finite numbers or a zero quaternion."""
    position, q = message.position, message.orientation
    numbers = (position.x, position.y, position.z, q.x, q.y, q.z, q.w)
    if not all(map(math.isfinite, numbers)) or not any((q.x, q.y, q.z, q.w)):
        return None
    return (position.x, position.y, geometry.yaw_from_quaternion(q.x, q.y, q.z, q.w))
