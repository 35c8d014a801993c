"""`PoseStamped` as `geometry_msgs/PoseStamped`."""

from geometry_msgs.msg import PoseStamped as PoseStampedMessage

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import PoseStamped


def to_message(value: PoseStamped) -> PoseStampedMessage:
    """Converts a value to a message."""
    return convert.make(
        PoseStampedMessage,
        convert.header(value.stamp, value.frame_id),
        convert.pose(*value.pose),
    )


def serialize(value: PoseStamped) -> bytes:
    """Converts a value to a serialized message."""
    return packing.header(value.stamp, value.frame_id) + packing.pose(*value.pose)


register_adapter(PoseStamped, PoseStampedMessage, to_message, serialize=serialize)
