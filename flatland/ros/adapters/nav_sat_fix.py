"""`NavSatFix` as `sensor_msgs/NavSatFix`."""

from sensor_msgs.msg import NavSatFix as NavSatFixMessage
from sensor_msgs.msg import NavSatStatus

from flatland.ros.adapters import convert, register_adapter
from flatland.values import NavSatFix


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


register_adapter(NavSatFix, NavSatFixMessage, to_message)
