"""`SemanticScan` as the message `SemanticScan` of the selected package."""

import struct
from typing import Any, Final

import numpy as np

from flatland.ros.adapters import convert, packing, register_adapter
from flatland.ros.message_types import message_class
from flatland.values import SemanticLabel, SemanticScan

_SemanticLabel = message_class("SemanticLabel")
_SemanticScan = message_class("SemanticScan")
_GEOMETRY: Final = struct.Struct("<5f")


def to_message(value: SemanticScan) -> Any:
    """Converts a value to a message."""
    return _SemanticScan(
        convert.header(value.stamp, value.frame_id),
        value.angle_min,
        value.angle_max,
        value.angle_increment,
        value.range_min,
        value.range_max,
        value.ranges.tolist(),
        value.labels.tolist(),
        [
            _SemanticLabel(label.name, label.body, list(label.layers), label.class_name)
            for label in value.table
        ],
    )


def serialize(value: SemanticScan) -> bytes:
    """Converts a value to a serialized message."""
    labels = np.asarray(value.labels, dtype="<u4")
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            _GEOMETRY.pack(
                value.angle_min,
                value.angle_max,
                value.angle_increment,
                value.range_min,
                value.range_max,
            ),
            packing.float_array(value.ranges),
            packing.COUNT.pack(labels.size),
            labels.tobytes(),
            packing.COUNT.pack(len(value.table)),
            *map(_label, value.table),
        )
    )


def _label(label: SemanticLabel) -> bytes:
    return b"".join(
        (
            packing.text(label.name),
            packing.text(label.body),
            packing.COUNT.pack(len(label.layers)),
            *map(packing.text, label.layers),
            packing.text(label.class_name),
        )
    )


register_adapter(SemanticScan, _SemanticScan, to_message, serialize=serialize)
