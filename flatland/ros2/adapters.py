"""The adapters of ROS 2, which convert values to messages and back.

Other packages register their own adapters:

    from flatland.ros2.adapters import register_adapter
    register_adapter(Temperature, sensor_msgs.msg.Temperature, to_message=make_message)
"""

from __future__ import annotations

from typing import Any

from rclpy.serialization import deserialize_message

from flatland.node.adapters import Adapters, receivers
from flatland.node.transport import Adapter as Adapter
from flatland.ros2.message_types import message_class
from flatland.ros2.writer import CdrWriter
from flatland.values import Twist


class _Ros2Adapters(Adapters):
    """The adapters of messages that rosidl generates."""

    def message_class(self, name: str) -> type[Any]:
        """Imports a message class."""
        return message_class(name)

    def deserialize(self, message_type: type[Any], data: bytes) -> Any:
        """Returns a serialized message as an object."""
        return deserialize_message(data, message_type)


_adapters = _Ros2Adapters(CdrWriter)
register_adapter = _adapters.register
find_adapter = _adapters.find
message_field = _adapters.field


def use_stamped_twists() -> None:
    """Receives velocity commands as `TwistStamped` from now on, without use of the stamp."""
    register_adapter(
        Twist,
        message_class("geometry_msgs/TwistStamped"),
        from_message=lambda message: receivers.twist(message.twist),
    )
