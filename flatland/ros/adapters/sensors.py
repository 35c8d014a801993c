"""Values as messages of `sensor_msgs`."""

import struct
from typing import Final

import numpy as np
from sensor_msgs.msg import Imu as ImuMessage
from sensor_msgs.msg import JointState as JointStateMessage
from sensor_msgs.msg import LaserScan as LaserScanMessage
from sensor_msgs.msg import NavSatFix as NavSatFixMessage
from sensor_msgs.msg import NavSatStatus
from sensor_msgs.msg import Range as RangeMessage

from flatland.geometry import quaternion_from_yaw
from flatland.ros.adapters import packing, register_built_in
from flatland.values import Imu, JointState, LaserScan, NavSatFix, Range

_VECTOR_3: Final = struct.Struct("<3d")
_VECTOR_4: Final = struct.Struct("<4d")
_SCAN_GEOMETRY: Final = struct.Struct("<7f")
_READING: Final = struct.Struct("<B4f")
_RADIATION: Final = {"ultrasound": RangeMessage.ULTRASOUND, "infrared": RangeMessage.INFRARED}
_FIX: Final = struct.pack("<bH", NavSatStatus.STATUS_FIX, NavSatStatus.SERVICE_GPS)
_UNKNOWN_COVARIANCE: Final = bytes(9 * 8) + bytes([NavSatFixMessage.COVARIANCE_TYPE_UNKNOWN])


def laser_scan(value: LaserScan) -> bytes:
    """Serializes a `LaserScan`."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            _SCAN_GEOMETRY.pack(
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


def imu(value: Imu) -> bytes:
    """Serializes an `Imu`."""
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


def range_reading(value: Range) -> bytes:
    """Serializes a `Range`."""
    return packing.header(value.stamp, value.frame_id) + _READING.pack(
        _RADIATION[value.radiation_type],
        value.field_of_view,
        value.min_range,
        value.max_range,
        value.range,
    )


def nav_sat_fix(value: NavSatFix) -> bytes:
    """Serializes a `NavSatFix` with unknown covariance."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            _FIX,
            _VECTOR_3.pack(value.latitude, value.longitude, value.altitude),
            _UNKNOWN_COVARIANCE,
        )
    )


def joint_state(value: JointState) -> bytes:
    """Serializes a `JointState` without efforts."""
    count = packing.COUNT.pack(len(value.names))
    return b"".join(
        (
            packing.header(value.stamp, ""),
            count,
            *(packing.text(name) for name in value.names),
            count,
            packing.doubles(np.array(value.positions)),
            count,
            packing.doubles(np.array(value.velocities)),
            packing.COUNT.pack(0),
        )
    )


register_built_in(LaserScan, LaserScanMessage, serialize=laser_scan)
register_built_in(Imu, ImuMessage, serialize=imu)
register_built_in(Range, RangeMessage, serialize=range_reading)
register_built_in(NavSatFix, NavSatFixMessage, serialize=nav_sat_fix)
register_built_in(JointState, JointStateMessage, serialize=joint_state)
