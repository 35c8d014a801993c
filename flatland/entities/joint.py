"""Joints between the bodies of a model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flatland.entities.body import Body, Color
from flatland.geometry import DoubleArray

if TYPE_CHECKING:
    from flatland.physics import PhysicsJoint


class Joint:
    """A named Box2D joint of a model."""

    __slots__ = ("bodies", "color", "name", "physics")

    def __init__(
        self, physics: PhysicsJoint, name: str, bodies: tuple[Body, Body], color: Color
    ) -> None:
        """Names a physics joint.

        Args:
            physics: The joint in the physics world.
            name: Unique within the model.
            bodies: Body A and body B.
            color: (r, g, b, a), each 0 to 1, for pictures.
        """
        self.physics = physics
        self.name = name
        self.bodies = bodies
        self.color = color

    def __repr__(self) -> str:
        """Names the joint and its kind."""
        return f"<{self.type} joint {self.name!r}>"

    @property
    def type(self) -> str:
        """`revolute` or `weld`."""
        return self.physics.type

    @property
    def anchors(self) -> DoubleArray:
        """Anchor of each body in its frame [m], shape (2, 2)."""
        return np.asarray(self.physics.anchors, dtype=np.float64)

    @property
    def collide_connected(self) -> bool:
        """Whether the two bodies collide with each other."""
        return self.physics.collide_connected

    @property
    def limits(self) -> tuple[float, float] | None:
        """Lower and upper angle of a revolute joint [rad], None without limits."""
        return self.physics.limits

    @property
    def reference_angle(self) -> float:
        """Angle of body B in body A at rest [rad]."""
        return self.physics.reference_angle

    @property
    def frequency(self) -> float:
        """Spring frequency of a weld joint [Hz], 0 when rigid."""
        return self.physics.frequency

    @property
    def damping(self) -> float:
        """Damping ratio of a weld joint's spring."""
        return self.physics.damping
