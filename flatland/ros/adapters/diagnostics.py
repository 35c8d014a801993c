"""`Diagnostics` as `diagnostic_msgs/DiagnosticArray`."""

from typing import Final

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from flatland.node.names import sendable_text
from flatland.node.values import Diagnostics
from flatland.ros.adapters import register_built_in

HARDWARE_ID: Final = "flatland"


def to_message(value: Diagnostics) -> DiagnosticArray:
    """Converts a value to a message with the current ROS time."""
    message = DiagnosticArray()
    message.header.stamp = rospy.get_rostime()
    message.status = [
        DiagnosticStatus(
            level=int(status.level),
            name=status.name,
            message=sendable_text(status.text),
            hardware_id=HARDWARE_ID,
            values=[
                KeyValue(sendable_text(key), sendable_text(text))
                for key, text in status.values.items()
            ],
        )
        for status in value
    ]
    return message


register_built_in(Diagnostics, DiagnosticArray, to_message=to_message)
