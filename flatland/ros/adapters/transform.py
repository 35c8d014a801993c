"""`Transform` as `geometry_msgs/TransformStamped`."""

from geometry_msgs.msg import Transform as TransformMessage
from geometry_msgs.msg import TransformStamped, Vector3

from flatland.ros.adapters import convert, register_adapter
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


register_adapter(Transform, TransformStamped, to_message)
