"""Handles of joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flatland.geometry import DoubleArray
from flatland.physics.handle import Handle

if TYPE_CHECKING:
    from flatland.physics.body import PhysicsBody


class PhysicsJoint(Handle):
    """Handle of a joint.

    All members except `alive` raise `StaleHandleError` once the joint or one of its bodies is
    destroyed.

    Attributes:
        id: Id of the joint, never reused in its world.
        world: Physics world that contains the joint.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the joint exists."""
        return self._core.has_joint(self.id)

    def destroy(self) -> None:
        """Destroys the joint and wakes its bodies.

        Raises:
            StaleHandleError: The joint has already been destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.destroy_joint(self.id)

    @property
    def type(self) -> str:
        """Type of the joint, `revolute` or `weld`."""
        return self._core.joint_type(self.id)

    @property
    def body_a(self) -> PhysicsBody:
        """First body."""
        return self.world.body(self._core.joint_bodies(self.id)[0])

    @property
    def body_b(self) -> PhysicsBody:
        """Second body."""
        return self.world.body(self._core.joint_bodies(self.id)[1])

    @property
    def anchors(self) -> DoubleArray:
        """Anchor points in the frames of the first and second body [m], shape (2, 2)."""
        return np.array(self._core.joint_anchors(self.id))

    @property
    def collide_connected(self) -> bool:
        """Whether the two bodies collide with each other."""
        return self._core.joint_collide_connected(self.id)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Lower and upper angle [rad]; None without limits, and for a weld joint."""
        return self._core.joint_limits(self.id)

    def set_limits(self, lower: float, upper: float) -> None:
        """Sets the limits of a revolute joint.

        Args:
            lower: Lower angle [rad].
            upper: Upper angle [rad].

        Raises:
            ValueError: A number is not finite, or the lower limit is above the upper one.
            PhysicsError: The joint is a weld joint.
            StaleHandleError: The joint was destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.set_joint_limits(self.id, (lower, upper))

    def clear_limits(self) -> None:
        """Removes the limits of a revolute joint.

        Raises:
            PhysicsError: The joint is a weld joint.
            StaleHandleError: The joint was destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.set_joint_limits(self.id, None)

    @property
    def reference_angle(self) -> float:
        """Angle of the second body relative to the first one at rest [rad]."""
        return self._core.joint_reference_angle(self.id)

    @property
    def frequency(self) -> float:
        """Spring frequency of a weld joint [Hz]; 0 if the joint is rigid."""
        return self._core.joint_frequency(self.id)

    @property
    def damping(self) -> float:
        """Damping ratio of the spring of a weld joint."""
        return self._core.joint_damping(self.id)
