"""`Collisions` as the message `Collisions` of the selected package."""

from typing import Any

from flatland.ros.adapters import convert, register_adapter
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


register_adapter(Collisions, _Collisions, to_message)
