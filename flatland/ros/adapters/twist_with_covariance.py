"""`TwistWithCovariance` as `geometry_msgs/TwistWithCovarianceStamped`."""

from geometry_msgs.msg import TwistWithCovariance as TwistWithCovarianceMessage
from geometry_msgs.msg import TwistWithCovarianceStamped

from flatland.ros.adapters import convert, register_adapter
from flatland.values import TwistWithCovariance


def to_message(value: TwistWithCovariance) -> TwistWithCovarianceStamped:
    """Converts a value to a message."""
    return TwistWithCovarianceStamped(
        convert.header(value.stamp, value.frame_id),
        TwistWithCovarianceMessage(
            convert.twist(*value.twist), convert.covariance(value.covariance)
        ),
    )


register_adapter(TwistWithCovariance, TwistWithCovarianceStamped, to_message)
