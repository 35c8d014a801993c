"""Values as messages of `std_msgs` and `geometry_msgs`."""

from typing import Any

from geometry_msgs.msg import (
    PoseArray,
    PoseWithCovarianceStamped,
    TransformStamped,
    TwistWithCovarianceStamped,
)
from geometry_msgs.msg import PoseStamped as PoseStampedMessage
from geometry_msgs.msg import Twist as TwistMessage
from std_msgs.msg import Bool

from flatland.node.values import ReceivedPose
from flatland.ros.adapters import convert, packing, register_built_in
from flatland.values import People, PoseStamped, Transform, Twist, TwistWithCovariance


def boolean(value: bool) -> bytes:
    """Serializes a `Bool`."""
    return b"\1" if value else b"\0"


def twist(value: Twist) -> bytes:
    """Serializes a `Twist`."""
    return packing.twist((value.linear_x, value.linear_y, value.angular_z))


def received_twist(message: TwistMessage) -> Twist:
    """Converts a message to a value, discarding the components outside the plane."""
    return Twist(message.linear.x, message.linear.y, message.angular.z)


def twist_with_covariance(value: TwistWithCovariance) -> bytes:
    """Serializes a `TwistWithCovarianceStamped`."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            packing.twist(value.twist),
            packing.covariance(value.covariance, 6),
        )
    )


def pose_stamped(value: PoseStamped) -> bytes:
    """Serializes a `PoseStamped`."""
    return packing.header(value.stamp, value.frame_id) + packing.pose(*value.pose)


def received_pose(message: PoseWithCovarianceStamped) -> ReceivedPose:
    """Converts a message to a value, discarding the covariance."""
    return ReceivedPose(message.header.frame_id.lstrip("/"), convert.planar_pose(message.pose.pose))


def transform(value: Transform) -> bytes:
    """Serializes a `TransformStamped`."""
    return b"".join(
        (
            packing.header(value.stamp, value.parent),
            packing.text(value.child),
            packing.pose(value.x, value.y, value.yaw, value.roll),
        )
    )


def people(value: People) -> bytes:
    """Serializes a `PoseArray`."""
    poses = value.poses.tolist()
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            packing.COUNT.pack(len(poses)),
            *(packing.pose(x, y, yaw) for x, y, yaw in poses),
        )
    )


def _received_bool(message: Any) -> bool:
    return bool(message.data)


register_built_in(bool, Bool, from_message=_received_bool, serialize=boolean)
register_built_in(Twist, TwistMessage, from_message=received_twist, serialize=twist)
register_built_in(TwistWithCovariance, TwistWithCovarianceStamped, serialize=twist_with_covariance)
register_built_in(PoseStamped, PoseStampedMessage, serialize=pose_stamped)
register_built_in(ReceivedPose, PoseWithCovarianceStamped, from_message=received_pose)
register_built_in(Transform, TransformStamped, serialize=transform)
register_built_in(People, PoseArray, serialize=people)
