"""Named joints between the bodies of a model."""

from __future__ import annotations

from flatland.entities.body import Body, Color
from flatland.physics import PhysicsJoint


class Joint(PhysicsJoint):
    """A named joint of a model.

    Attributes:
        name: Name of the joint, unique within the model.
        bodies: Body A and body B.
        color: Color for drawings as (r, g, b, a), each in [0, 1].
    """

    __slots__ = ("bodies", "color", "name")

    def __init__(
        self, physics: PhysicsJoint, name: str, bodies: tuple[Body, Body], color: Color
    ) -> None:
        """Creates a named handle of a joint.

        Args:
            physics: Handle of the joint.
            name: Name of the joint, unique within the model.
            bodies: Body A and body B.
            color: Color for drawings as (r, g, b, a), each in [0, 1].
        """
        super().__init__(physics.world, physics.id)
        self.name = name
        self.bodies = bodies
        self.color = color

    def __repr__(self) -> str:
        return f"<{self.type} joint {self.name!r}>"

    @property
    def physics(self) -> PhysicsJoint:
        """The joint itself; kept for plugins that access the physics as `joint.physics`."""
        return self
