"""`Odometry` as `nav_msgs/Odometry`."""

from geometry_msgs.msg import PoseWithCovariance, TwistWithCovariance
from nav_msgs.msg import Odometry as OdometryMessage

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import Odometry


def to_message(value: Odometry) -> OdometryMessage:
    """Converts a value to a message."""
    make = convert.make
    return make(
        OdometryMessage,
        convert.header(value.stamp, value.frame_id),
        value.child_frame_id,
        make(
            PoseWithCovariance,
            convert.pose(*value.pose),
            convert.covariance(value.pose_covariance),
        ),
        make(
            TwistWithCovariance,
            convert.twist(*value.twist),
            convert.covariance(value.twist_covariance),
        ),
    )


def serialize(value: Odometry) -> bytes:
    """Converts a value to a serialized message."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            packing.text(value.child_frame_id),
            packing.pose(*value.pose),
            packing.covariance(value.pose_covariance, 6),
            packing.twist(value.twist),
            packing.covariance(value.twist_covariance, 6),
        )
    )


register_adapter(Odometry, OdometryMessage, to_message, serialize=serialize)
