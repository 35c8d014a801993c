"""`Range` as `sensor_msgs/Range`."""

import struct
from typing import Final

from sensor_msgs.msg import Range as RangeMessage

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import Range

_TYPES: Final = {"ultrasound": RangeMessage.ULTRASOUND, "infrared": RangeMessage.INFRARED}
_READING: Final = struct.Struct("<B4f")


def to_message(value: Range) -> RangeMessage:
    """Converts a value to a message."""
    return RangeMessage(
        convert.header(value.stamp, value.frame_id),
        _TYPES[value.radiation_type],
        value.field_of_view,
        value.min_range,
        value.max_range,
        value.range,
    )


def serialize(value: Range) -> bytes:
    """Converts a value to a serialized message."""
    return packing.header(value.stamp, value.frame_id) + _READING.pack(
        _TYPES[value.radiation_type],
        value.field_of_view,
        value.min_range,
        value.max_range,
        value.range,
    )


register_adapter(Range, RangeMessage, to_message, serialize=serialize)
