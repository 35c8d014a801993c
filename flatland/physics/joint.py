"""Handles of joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flatland.geometry import DoubleArray
from flatland.physics.handle import Handle

if TYPE_CHECKING:
    from flatland.physics.body import PhysicsBody


class PhysicsJoint(Handle):
    """Handle of a joint; every use raises `StaleHandleError` once it or a body is destroyed.

    Attributes:
        id: Its number in the world, never used again for another joint.
        world: The world it is in.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the joint is still there."""
        return self._core.has_joint(self.id)

    def destroy(self) -> None:
        """Takes the joint out of the world and wakes its bodies.

        Raises:
            StaleHandleError: It is gone already.
            WorldLockedError: The world is stepping.
        """
        self._core.destroy_joint(self.id)

    @property
    def type(self) -> str:
        """`revolute` or `weld`."""
        return self._core.joint_type(self.id)

    @property
    def body_a(self) -> PhysicsBody:
        """The first body."""
        return self.world.body(self._core.joint_bodies(self.id)[0])

    @property
    def body_b(self) -> PhysicsBody:
        """The second body."""
        return self.world.body(self._core.joint_bodies(self.id)[1])

    @property
    def anchors(self) -> DoubleArray:
        """Anchor of each body in its frame [m], shape (2, 2)."""
        return np.array(self._core.joint_anchors(self.id))

    @property
    def collide_connected(self) -> bool:
        """Whether the two bodies collide with each other."""
        return self._core.joint_collide_connected(self.id)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Lower and upper angle of a revolute joint [rad], None without limits and for welds."""
        return self._core.joint_limits(self.id)

    def set_limits(self, lower: float, upper: float) -> None:
        """Sets the limits of a revolute joint [rad].

        Raises:
            ValueError: A number is not finite, or the lower limit is above the upper one.
            PhysicsError: It is a weld joint.
            StaleHandleError: The joint is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.set_joint_limits(self.id, (lower, upper))

    def clear_limits(self) -> None:
        """Takes the limits of a revolute joint away.

        Raises:
            PhysicsError: It is a weld joint.
            StaleHandleError: The joint is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.set_joint_limits(self.id, None)

    @property
    def reference_angle(self) -> float:
        """Angle of body B relative to body A at rest [rad]."""
        return self._core.joint_reference_angle(self.id)

    @property
    def frequency(self) -> float:
        """Spring frequency of a weld joint [Hz], 0 when rigid."""
        return self._core.joint_frequency(self.id)

    @property
    def damping(self) -> float:
        """Damping ratio of a weld joint's spring."""
        return self._core.joint_damping(self.id)
