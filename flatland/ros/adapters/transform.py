"""`Transform` as `geometry_msgs/TransformStamped`."""

from collections.abc import Sequence

from geometry_msgs.msg import Transform as TransformMessage
from geometry_msgs.msg import TransformStamped, Vector3

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import Transform


def to_message(value: Transform) -> TransformStamped:
    """Converts a value to a message."""
    make = convert.make
    return make(
        TransformStamped,
        convert.header(value.stamp, value.parent),
        value.child,
        make(
            TransformMessage,
            make(Vector3, value.x, value.y, 0.0),
            convert.quaternion(value.yaw, value.roll),
        ),
    )


def serialize(value: Transform) -> bytes:
    """Converts a value to a serialized message."""
    return b"".join(
        (
            packing.header(value.stamp, value.parent),
            packing.text(value.child),
            packing.pose(value.x, value.y, value.yaw, value.roll),
        )
    )


def serialize_all(values: Sequence[Transform]) -> bytes:
    """Converts values to a serialized `TFMessage`."""
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


register_adapter(Transform, TransformStamped, to_message, serialize=serialize)
