"""`Twist` as `geometry_msgs/Twist`."""

from geometry_msgs.msg import Twist as TwistMessage

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import Twist


def to_message(value: Twist) -> TwistMessage:
    """Converts a value to a message."""
    return convert.twist(value.linear_x, value.linear_y, value.angular_z)


def from_message(message: TwistMessage) -> Twist:
    """Converts a message to a value, discarding the components outside the plane."""
    return Twist(message.linear.x, message.linear.y, message.angular.z)


def serialize(value: Twist) -> bytes:
    """Converts a value to a serialized message."""
    return packing.twist((value.linear_x, value.linear_y, value.angular_z))


register_adapter(Twist, TwistMessage, to_message, from_message, serialize)
