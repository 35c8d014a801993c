"""`LaserScan` as `sensor_msgs/LaserScan`."""

import struct
from typing import Any, Final

import numpy as np
from sensor_msgs.msg import LaserScan as LaserScanMessage

from flatland.geometry import FloatArray
from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import LaserScan

_GEOMETRY: Final = struct.Struct("<7f")


class PackedLaserScan(LaserScanMessage):  # type: ignore[misc]
    """A scan whose ranges and intensities are float32 arrays, serialized without a copy per beam.

    The default serialization of rospy iterates over the beams in Python.
    """

    __slots__ = LaserScanMessage.__slots__  # genpy reads the field names from here

    def serialize(self, buff: Any) -> None:
        """Serializes the message; called by rospy."""
        self.serialize_numpy(buff, np)


def to_message(value: LaserScan) -> PackedLaserScan:
    """Converts a value to a message."""
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


def serialize(value: LaserScan) -> bytes:
    """Converts a value to a serialized message."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            _GEOMETRY.pack(
                value.angle_min,
                value.angle_max,
                value.angle_increment,
                value.time_increment,
                value.scan_time,
                value.range_min,
                value.range_max,
            ),
            packing.float_array(value.ranges),
            packing.float_array(value.intensities),
        )
    )


def _packed(numbers: FloatArray) -> FloatArray:
    """Converts an array to the wire format, little-endian float32."""
    return np.asarray(numbers, dtype="<f4")


register_adapter(LaserScan, LaserScanMessage, to_message, serialize=serialize)
