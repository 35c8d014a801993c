"""`JointState` as `sensor_msgs/JointState`."""

import numpy as np
from sensor_msgs.msg import JointState as JointStateMessage

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.values import JointState


def to_message(value: JointState) -> JointStateMessage:
    """Converts a value to a message; the efforts are unknown."""
    return JointStateMessage(
        convert.header(value.stamp, ""),
        list(value.names),
        list(value.positions),
        list(value.velocities),
        [],
    )


def serialize(value: JointState) -> bytes:
    """Converts a value to a serialized message."""
    count = packing.COUNT.pack(len(value.names))
    return b"".join(
        (
            packing.header(value.stamp, ""),
            count,
            *(packing.text(name) for name in value.names),
            count,
            packing.doubles(np.array(value.positions)),
            count,
            packing.doubles(np.array(value.velocities)),
            packing.COUNT.pack(0),
        )
    )


register_adapter(JointState, JointStateMessage, to_message, serialize=serialize)
