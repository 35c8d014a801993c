"""`Collisions` as `flatland/Collisions`."""

from flatland.msg import Collision as CollisionMessage
from flatland.msg import Collisions as CollisionsMessage
from flatland.msg import Vector2
from flatland.ros.adapters import convert, register_adapter
from flatland.values import Collision, Collisions


def to_message(value: Collisions) -> CollisionsMessage:
    """Converts a value to a message."""
    return CollisionsMessage(
        convert.header(value.stamp, value.frame_id),
        [_collision(collision) for collision in value.collisions],
    )


def _collision(value: Collision) -> CollisionMessage:
    return CollisionMessage(
        value.entity_a,
        value.body_a,
        value.entity_b,
        value.body_b,
        value.magnitude_forces.tolist(),
        [Vector2(x, y) for x, y in value.contact_positions.tolist()],
        [Vector2(x, y) for x, y in value.contact_normals.tolist()],
    )


register_adapter(Collisions, CollisionsMessage, to_message)
