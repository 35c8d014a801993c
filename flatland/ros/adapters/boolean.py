"""`bool` as `std_msgs/Bool`."""

from std_msgs.msg import Bool

from flatland.ros.adapters import register_adapter


def to_message(value: bool) -> Bool:
    """Converts a value to a message."""
    return Bool(value)


def serialize(value: bool) -> bytes:
    """Converts a value to a serialized message."""
    return b"\1" if value else b"\0"


def from_message(message: Bool) -> bool:
    """Converts a message to a value."""
    return bool(message.data)


register_adapter(bool, Bool, to_message, from_message, serialize)
