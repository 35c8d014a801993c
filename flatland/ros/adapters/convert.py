"""Conversion of message parts: stamps, headers, poses."""

from __future__ import annotations

from genpy import Time
from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import Header

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
