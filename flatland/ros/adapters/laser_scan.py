"""`LaserScan` as `sensor_msgs/LaserScan`."""

from typing import Any

import numpy as np
from sensor_msgs.msg import LaserScan as LaserScanMessage

from flatland.geometry import FloatArray
from flatland.ros.adapters import convert, register_adapter
from flatland.values import LaserScan


class PackedLaserScan(LaserScanMessage):  # type: ignore[misc]
    """A scan whose ranges and intensities are float32 arrays that go out as they lie in memory.

    rospy's way for arrays would visit every beam in Python.
    """

    __slots__ = LaserScanMessage.__slots__  # genpy reads the names of the fields from here

    def serialize(self, buff: Any) -> None:
        """Writes the message; rospy calls it."""
        self.serialize_numpy(buff, np)


def to_message(value: LaserScan) -> PackedLaserScan:
    """Makes a message from a value."""
    return PackedLaserScan(
        convert.header(value.stamp, value.frame_id),
        value.angle_min,
        value.angle_max,
        value.angle_increment,
        value.time_increment,
        value.scan_time,
        value.range_min,
        value.range_max,
        _packed(value.ranges),
        _packed(value.intensities),
    )


def _packed(numbers: FloatArray) -> FloatArray:
    """Makes sure that the memory holds what the wire wants: float32, little-endian."""
    return np.asarray(numbers, dtype="<f4")


register_adapter(LaserScan, LaserScanMessage, to_message)
