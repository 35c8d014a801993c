"""Handles of rigid bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy.typing as npt

from flatland.geometry import FloatArray, Pose, Vector2
from flatland.physics.fixture import ALL_BITS
from flatland.physics.handle import Handle

if TYPE_CHECKING:
    from flatland.physics.fixture import PhysicsFixture
    from flatland.physics.joint import PhysicsJoint


class PhysicsBody(Handle):
    """Handle of a rigid body; every use raises `StaleHandleError` once it is destroyed.

    Attributes:
        id: Its number in the world, never used again for another body.
        world: The world it is in.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the body is still there."""
        return self._core.has_body(self.id)

    def destroy(self) -> None:
        """Takes the body out of the world, with its fixtures and joints; contacts end.

        Raises:
            StaleHandleError: It is gone already.
            WorldLockedError: The world is stepping.
        """
        self._core.destroy_body(self.id)

    @property
    def type(self) -> str:
        """`static`, `kinematic` or `dynamic`."""
        return self._core.body_type(self.id)

    @property
    def pose(self) -> Pose:
        """(x, y, theta) of the body's origin in the world frame [m, rad]."""
        return self._core.pose(self.id)

    def set_pose(self, x: float, y: float, theta: float) -> None:
        """Puts the body's origin at a pose in the world frame and wakes the body.

        Raises:
            ValueError: A number is not finite.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.set_pose(self.id, x, y, theta)

    @property
    def velocity(self) -> Pose:
        """(vx, vy, omega) of the body's origin in the world frame [m/s, rad/s]."""
        return self._core.velocity(self.id)

    def set_velocity(self, vx: float, vy: float, omega: float) -> None:
        """Makes the body's origin move at (vx, vy), and the body turn at omega, world frame.

        Without effect on static bodies.

        Raises:
            ValueError: A number is not finite.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.set_velocity(self.id, vx, vy, omega)

    def apply_force(self, force: Sequence[float], point: Sequence[float]) -> None:
        """Applies a force to a dynamic body for the next step, and wakes it.

        Args:
            force: World frame [N].
            point: Where it acts, world frame [m].

        Raises:
            ValueError: A number is not finite, or the force is too large for the body's mass.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.apply_force(self.id, force[0], force[1], point[0], point[1])

    def apply_torque(self, torque: float) -> None:
        """Applies a torque about z [N m] to a dynamic body for the next step, and wakes it.

        Raises:
            ValueError: It is not finite, or too large for the body's inertia.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.apply_torque(self.id, torque)

    @property
    def awake(self) -> bool:
        """Whether the body is simulated; settable. Falling asleep sets its velocity to zero."""
        return self._core.awake(self.id)

    @awake.setter
    def awake(self, value: bool) -> None:
        self._core.set_awake(self.id, value)

    @property
    def mass(self) -> float:
        """Mass [kg]; 1 for a dynamic body whose fixtures have none, 0 if it is not dynamic."""
        return self._core.mass(self.id)

    @property
    def inertia(self) -> float:
        """Moment of inertia about the body's origin [kg m^2]."""
        return self._core.inertia(self.id)

    @property
    def local_center(self) -> Vector2:
        """Centre of mass in the body frame [m]."""
        return self._core.local_center(self.id)

    @property
    def world_center(self) -> Vector2:
        """Centre of mass in the world frame [m]."""
        return self._core.world_center(self.id)

    @property
    def linear_damping(self) -> float:
        """Linear damping [1/s]."""
        return self._core.linear_damping(self.id)

    @property
    def angular_damping(self) -> float:
        """Angular damping [1/s]."""
        return self._core.angular_damping(self.id)

    @property
    def fixtures(self) -> list[PhysicsFixture]:
        """All fixtures in the order in which they were made."""
        return [self.world.fixture(i) for i in self._core.fixtures(self.id)]

    def fixture(self, fixture_id: int) -> PhysicsFixture:
        """Returns the handle of a fixture of this world; it may be stale."""
        return self.world.fixture(fixture_id)

    @property
    def joints(self) -> list[PhysicsJoint]:
        """All joints that hold this body, in the order in which they were made."""
        return [self.world.joint(i) for i in self._core.joints(self.id)]

    def create_circle(
        self,
        center: Sequence[float],
        radius: float,
        *,
        density: float,
        friction: float = 0.0,
        restitution: float = 0.0,
        is_sensor: bool = False,
        category_bits: int = ALL_BITS,
        mask_bits: int = ALL_BITS,
    ) -> PhysicsFixture:
        """Adds a circle.

        Args:
            center: In the body frame [m].
            radius: At least 0 [m]; 0 makes a point without mass.
            density: At least 0 [kg/m^2].
            friction: At least 0.
            restitution: At least 0.
            is_sensor: Whether it only detects contacts.
            category_bits: What it is, 16 bits.
            mask_bits: What it collides with, 16 bits.

        Raises:
            ValueError: A number is out of range, or the body's mass would be.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        x, y = center
        fixture = self._core.create_circle(
            self.id,
            x,
            y,
            radius,
            density,
            friction,
            restitution,
            is_sensor,
            category_bits,
            mask_bits,
        )
        return self.world.fixture(fixture)

    def create_polygon(
        self,
        points: npt.ArrayLike,
        *,
        density: float,
        friction: float = 0.0,
        restitution: float = 0.0,
        is_sensor: bool = False,
        category_bits: int = ALL_BITS,
        mask_bits: int = ALL_BITS,
    ) -> PhysicsFixture:
        """Adds the convex hull of some points.

        Args:
            points: 3 to 8 points in the body frame [m], shape (k, 2). Points nearer than 2.5 mm
                to an earlier one are dropped, as Box2D does it.
            density: At least 0 [kg/m^2].
            friction: At least 0.
            restitution: At least 0.
            is_sensor: Whether it only detects contacts.
            category_bits: What it is, 16 bits.
            mask_bits: What it collides with, 16 bits.

        Raises:
            ValueError: Wrong shape, too few points apart from each other, no area, a number out
                of range, or the body's mass would be.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        fixture = self._core.create_polygon(
            self.id,
            points,
            density,
            friction,
            restitution,
            is_sensor,
            category_bits,
            mask_bits,
        )
        return self.world.fixture(fixture)

    def create_edges(
        self,
        edges: npt.ArrayLike,
        *,
        friction: float = 0.0,
        restitution: float = 0.0,
        category_bits: int = ALL_BITS,
        mask_bits: int = ALL_BITS,
    ) -> int:
        """Adds many two-sided edges, each a fixture; other Python threads run meanwhile.

        Args:
            edges: (x1, y1, x2, y2) in the body frame [m], shape (n, 4), float32. Edges shorter
                than 1.2e-7 m have no direction and are left out: nothing could ever hit them.
            friction: At least 0.
            restitution: At least 0.
            category_bits: What they are, 16 bits.
            mask_bits: What they collide with, 16 bits.

        Returns:
            How many were made.

        Raises:
            ValueError: A shape is wrong or a number out of range; nothing was made.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        return self._core.create_edges(
            self.id,
            edges,
            friction,
            restitution,
            category_bits,
            mask_bits,
        )

    def edges(self) -> FloatArray:
        """Returns its edge fixtures (x1, y1, x2, y2) in the body frame [m], shape (n, 4)."""
        return self._core.edges(self.id)
