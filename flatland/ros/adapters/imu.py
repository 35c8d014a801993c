"""`Imu` as `sensor_msgs/Imu`."""

import struct
from typing import Final

from geometry_msgs.msg import Vector3
from sensor_msgs.msg import Imu as ImuMessage

from flatland.geometry import quaternion_from_yaw
from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import Imu

_VECTOR_3: Final = struct.Struct("<3d")
_VECTOR_4: Final = struct.Struct("<4d")


def to_message(value: Imu) -> ImuMessage:
    """Converts a value to a message."""
    return ImuMessage(
        convert.header(value.stamp, value.frame_id),
        convert.quaternion(value.yaw),
        convert.covariance(value.orientation_covariance),
        Vector3(0.0, 0.0, value.yaw_rate),
        convert.covariance(value.angular_velocity_covariance),
        Vector3(*value.linear_acceleration, 0.0),
        convert.covariance(value.linear_acceleration_covariance),
    )


def serialize(value: Imu) -> bytes:
    """Converts a value to a serialized message."""
    covariance = packing.covariance
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            _VECTOR_4.pack(*quaternion_from_yaw(value.yaw)),
            covariance(value.orientation_covariance, 3),
            _VECTOR_3.pack(0.0, 0.0, value.yaw_rate),
            covariance(value.angular_velocity_covariance, 3),
            _VECTOR_3.pack(*value.linear_acceleration, 0.0),
            covariance(value.linear_acceleration_covariance, 3),
        )
    )


register_adapter(Imu, ImuMessage, to_message, serialize=serialize)
