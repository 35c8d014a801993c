"""`Twist` as `geometry_msgs/Twist`."""

from geometry_msgs.msg import Twist as TwistMessage

from flatland.ros.adapters import convert, register_adapter
from flatland.values import Twist


def to_message(value: Twist) -> TwistMessage:
    """Makes a message from a value."""
    return convert.twist(value.linear_x, value.linear_y, value.angular_z)


def from_message(message: TwistMessage) -> Twist:
    """Makes a value from a message, less what does not lie in the plane."""
    return Twist(message.linear.x, message.linear.y, message.angular.z)


register_adapter(Twist, TwistMessage, to_message, from_message)
