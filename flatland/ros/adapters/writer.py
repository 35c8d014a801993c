"""Serialization of messages as `genpy` does it."""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import rospy

from flatland.geometry import Pose, quaternion_from_yaw
from flatland.node.adapters.writer import FLOAT64, LAYOUTS, Writer
from flatland.node.stamps import stamp as message_stamp
from flatland.timekeeper import NANOSECONDS

_COUNT: Final = struct.Struct("<I")
_STAMP: Final = struct.Struct("<2I")
_HEADER: Final = struct.Struct("<3I")
_POSE: Final = struct.Struct("<7d")
_TWIST: Final = struct.Struct("<6d")
_CACHED_STAMPS: Final = 16  # most messages of a step have the same one
_CACHED_TEXTS: Final = 4096  # frames and names of a large world


@lru_cache(_CACHED_TEXTS)
def _text(value: str) -> bytes:
    data = value.encode()
    return _COUNT.pack(len(data)) + data


@lru_cache(_CACHED_STAMPS)
def _header(time_ns: int) -> bytes:
    """Returns the sequence number 0 and the stamp of a ROS time [ns]."""
    return _HEADER.pack(0, *divmod(time_ns, NANOSECONDS))


class RosWriter(Writer):
    """Writes a message of ROS 1; the publisher sets the sequence number of its header."""

    def __init__(self) -> None:
        """Begins a message."""
        self.data = bytearray()

    def align(self, size: int) -> None:
        """Has no effect: messages have no padding."""

    def pack(self, code: str, *values: Any) -> None:
        """Writes up to 16 numbers of one type, without their count."""
        self.data += LAYOUTS[code][len(values)].pack(*values)

    def numbers(self, values: npt.NDArray[Any], kind: np.dtype[Any] = FLOAT64) -> None:
        """Writes the numbers of an array in row-major order, without their count."""
        if values.dtype is not kind:
            values = values.astype(kind)
        self.data += values.tobytes()

    def header(self, time_ns: int, frame_id: str) -> None:
        """Writes a `std_msgs/Header` with the sequence number 0."""
        self.data += _header(message_stamp(time_ns)) + _text(frame_id)

    def stamp(self, seconds: int, nanoseconds: int) -> int:
        """Writes the sequence number 0 and the stamp."""
        self.data += _HEADER.pack(0, seconds, nanoseconds)
        return len(self.data) - _STAMP.size

    def time(self, time_ns: int) -> None:
        """Writes the stamp of a simulated time [ns] without a header."""
        self.data += _STAMP.pack(*divmod(message_stamp(time_ns), NANOSECONDS))

    def pose(self, x: float, y: float, yaw: float, roll: float = 0.0) -> None:
        """Writes the position (x, y, 0) and the rotation by `roll`, then `yaw` [rad]."""
        self.data += _POSE.pack(x, y, 0.0, *quaternion_from_yaw(yaw, roll))

    def stamped_pose(
        self,
        time_ns: int,
        frame_id: str,
        child: str,
        x: float,
        y: float,
        yaw: float,
        roll: float = 0.0,
    ) -> None:
        """Writes a header, the id of the child frame, and its pose as `pose` does."""
        pose = _POSE.pack(x, y, 0.0, *quaternion_from_yaw(yaw, roll))
        self.data += _header(message_stamp(time_ns)) + _text(frame_id) + _text(child) + pose

    def twist(self, velocity: Pose) -> None:
        """Writes the planar velocity (vx, vy, omega)."""
        linear_x, linear_y, angular_z = velocity
        self.data += _TWIST.pack(linear_x, linear_y, 0.0, 0.0, 0.0, angular_z)

    def now(self) -> int:
        """Returns the current ROS time [ns]."""
        return int(rospy.get_rostime().to_nsec())

    def text(self, value: str) -> None:
        """Writes a string."""
        self.data += _text(value)

    def range_end(self) -> None:
        """Has no effect: the reading is the last field."""

    def marker_end(self, text: str) -> None:
        """Writes the text and an empty mesh."""
        self.text(text)
        self.text("")
        self.pack("B", 0)
