"""Transforms as `tf2_msgs/TFMessage`."""

from tf2_msgs.msg import TFMessage

from flatland.node.values import FrameParents, Transforms
from flatland.ros.adapters import packing, register_built_in


def serialize(values: Transforms) -> bytes:
    """Serializes the transforms of a step."""
    parts = [packing.COUNT.pack(len(values))]
    # Most transforms of a step have the same stamp.
    time_ns: int | None = None
    stamp = b""
    for value in values:
        if value.stamp != time_ns:
            time_ns = value.stamp
            stamp = packing.stamp(time_ns)
        parts += (
            stamp,
            packing.text(value.parent),
            packing.text(value.child),
            packing.pose(value.x, value.y, value.yaw, value.roll),
        )
    return b"".join(parts)


def frame_parents(message: TFMessage) -> FrameParents:
    """Returns the parent of each frame of a message."""
    # TF of other versions of ROS accepts frames with a leading slash.
    return FrameParents(
        (each.child_frame_id.lstrip("/"), each.header.frame_id.lstrip("/"))
        for each in message.transforms
    )


register_built_in(Transforms, TFMessage, serialize=serialize)
register_built_in(FrameParents, TFMessage, from_message=frame_parents)
