"""`NavSatFix` as `sensor_msgs/NavSatFix`."""

import struct
from typing import Final

from sensor_msgs.msg import NavSatFix as NavSatFixMessage
from sensor_msgs.msg import NavSatStatus

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import NavSatFix

_STATUS: Final = struct.pack("<bH", NavSatStatus.STATUS_FIX, NavSatStatus.SERVICE_GPS)
_POSITION: Final = struct.Struct("<3d")
_UNKNOWN_COVARIANCE: Final = bytes(9 * 8) + bytes([NavSatFixMessage.COVARIANCE_TYPE_UNKNOWN])


def to_message(value: NavSatFix) -> NavSatFixMessage:
    """Converts a value to a message with unknown covariance."""
    return NavSatFixMessage(
        header=convert.header(value.stamp, value.frame_id),
        status=NavSatStatus(NavSatStatus.STATUS_FIX, NavSatStatus.SERVICE_GPS),
        latitude=value.latitude,
        longitude=value.longitude,
        altitude=value.altitude,
        position_covariance_type=NavSatFixMessage.COVARIANCE_TYPE_UNKNOWN,
    )


def serialize(value: NavSatFix) -> bytes:
    """Converts a value to a serialized message with unknown covariance."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            _STATUS,
            _POSITION.pack(value.latitude, value.longitude, value.altitude),
            _UNKNOWN_COVARIANCE,
        )
    )


register_adapter(NavSatFix, NavSatFixMessage, to_message, serialize=serialize)
