"""`TwistWithCovariance` as `geometry_msgs/TwistWithCovarianceStamped`."""

from geometry_msgs.msg import TwistWithCovariance as TwistWithCovarianceMessage
from geometry_msgs.msg import TwistWithCovarianceStamped

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import TwistWithCovariance


def to_message(value: TwistWithCovariance) -> TwistWithCovarianceStamped:
    """Converts a value to a message."""
    return TwistWithCovarianceStamped(
        convert.header(value.stamp, value.frame_id),
        TwistWithCovarianceMessage(
            convert.twist(*value.twist), convert.covariance(value.covariance)
        ),
    )


def serialize(value: TwistWithCovariance) -> bytes:
    """Converts a value to a serialized message."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            packing.twist(value.twist),
            packing.covariance(value.covariance, 6),
        )
    )


register_adapter(TwistWithCovariance, TwistWithCovarianceStamped, to_message, serialize=serialize)
