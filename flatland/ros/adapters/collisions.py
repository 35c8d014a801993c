"""`Collisions` as the message `Collisions` of the selected package."""

from typing import Any

from flatland.geometry import DoubleArray
from flatland.ros.adapters import convert, packing, register_adapter
from flatland.ros.message_types import message_class
from flatland.values import Collision, Collisions

_Collision = message_class("Collision")
_Collisions = message_class("Collisions")
_Vector2 = message_class("Vector2")


def to_message(value: Collisions) -> Any:
    """Converts a value to a message."""
    return _Collisions(
        convert.header(value.stamp, value.frame_id),
        [_collision(collision) for collision in value.collisions],
    )


def _collision(value: Collision) -> Any:
    return _Collision(
        value.entity_a,
        value.body_a,
        value.entity_b,
        value.body_b,
        value.magnitude_forces.tolist(),
        [_Vector2(x, y) for x, y in value.contact_positions.tolist()],
        [_Vector2(x, y) for x, y in value.contact_normals.tolist()],
    )


def serialize(value: Collisions) -> bytes:
    """Converts a value to a serialized message."""
    parts = [
        packing.header(value.stamp, value.frame_id),
        packing.COUNT.pack(len(value.collisions)),
    ]
    for collision in value.collisions:
        forces = collision.magnitude_forces
        parts += (
            packing.text(collision.entity_a),
            packing.text(collision.body_a),
            packing.text(collision.entity_b),
            packing.text(collision.body_b),
            packing.COUNT.pack(len(forces)),
            packing.doubles(forces),
            _points(collision.contact_positions),
            _points(collision.contact_normals),
        )
    return b"".join(parts)


def _points(points: DoubleArray) -> bytes:
    """Serializes an array of points (x, y), shape (k, 2)."""
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must have shape (k, 2), got {points.shape}")
    return packing.COUNT.pack(len(points)) + packing.doubles(points)


register_adapter(Collisions, _Collisions, to_message, serialize=serialize)
