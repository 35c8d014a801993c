"""Handles of rigid bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy.typing as npt

from flatland.geometry import FloatArray, Pose, Vector2
from flatland.physics.body_control import BodyControl
from flatland.physics.fixture import ALL_BITS

if TYPE_CHECKING:
    from flatland.physics.fixture import PhysicsFixture
    from flatland.physics.joint import PhysicsJoint
    from flatland.physics.material import Material


class PhysicsBody(BodyControl):
    """Handle of a rigid body.

    All members except `alive` raise `StaleHandleError` once the body is destroyed.

    Attributes:
        id: Id of the body, never reused in its world.
        world: Physics world that contains the body.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the body exists."""
        return self._core.has_body(self.id)

    def destroy(self) -> None:
        """Destroys the body with its fixtures and joints, and ends its contacts.

        Raises:
            StaleHandleError: The body has already been destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.destroy_body(self.id)

    @property
    def type(self) -> str:
        """Type of the body, `static`, `kinematic` or `dynamic`."""
        return self._core.body_type(self.id)

    @property
    def pose(self) -> Pose:
        """Pose (x, y, theta) of the origin of the body in the world frame [m, rad]."""
        return self._core.pose(self.id)

    def set_pose(self, x: float, y: float, theta: float) -> None:
        """Moves the origin of the body to a pose in the world frame and wakes the body.

        Raises:
            ValueError: A number is not finite.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.set_pose(self.id, x, y, theta)

    @property
    def velocity(self) -> Pose:
        """Velocity (vx, vy, omega) of the origin of the body in the world frame [m/s, rad/s]."""
        return self._core.velocity(self.id)

    def set_velocity(self, vx: float, vy: float, omega: float) -> None:
        """Sets the velocity of the origin of the body in the world frame; static bodies ignore it.

        Args:
            vx: Velocity along x [m/s].
            vy: Velocity along y [m/s].
            omega: Angular velocity [rad/s].

        Raises:
            ValueError: A number is not finite.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.set_velocity(self.id, vx, vy, omega)

    def apply_force(self, force: Sequence[float], point: Sequence[float]) -> None:
        """Applies a force to a dynamic body during the next step and wakes the body.

        Args:
            force: Force in the world frame [N].
            point: Point of application in the world frame [m].

        Raises:
            ValueError: A number is not finite, or the force is too large for the mass.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.apply_force(self.id, force[0], force[1], point[0], point[1])

    def apply_torque(self, torque: float) -> None:
        """Applies a torque to a dynamic body during the next step and wakes the body.

        Args:
            torque: Torque about the z axis [N m].

        Raises:
            ValueError: The torque is not finite, or too large for the moment of inertia.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.apply_torque(self.id, torque)

    @property
    def awake(self) -> bool:
        """Whether the body is awake; settable. Box2D simulates only bodies that are awake.

        A body that is put to sleep loses its velocity.
        """
        return self._core.awake(self.id)

    @awake.setter
    def awake(self, value: bool) -> None:
        self._core.set_awake(self.id, value)

    @property
    def mass(self) -> float:
        """Mass [kg], 1 for a dynamic body without massive fixtures, 0 if it is not dynamic."""
        return self._core.mass(self.id)

    @property
    def inertia(self) -> float:
        """Moment of inertia about the origin of the body [kg m^2]."""
        return self._core.inertia(self.id)

    @property
    def local_center(self) -> Vector2:
        """Center of mass in the body frame [m]."""
        return self._core.local_center(self.id)

    @property
    def world_center(self) -> Vector2:
        """Center of mass in the world frame [m]."""
        return self._core.world_center(self.id)

    @property
    def linear_damping(self) -> float:
        """Linear damping coefficient [1/s]."""
        return self._core.linear_damping(self.id)

    @property
    def angular_damping(self) -> float:
        """Angular damping coefficient [1/s]."""
        return self._core.angular_damping(self.id)

    @property
    def fixtures(self) -> list[PhysicsFixture]:
        """Fixtures of the body in order of creation."""
        return [self.world.fixture(i) for i in self._core.fixtures(self.id)]

    @property
    def fixture_ids(self) -> list[int]:
        """Ids of the fixtures of the body in order of creation."""
        return self._core.fixtures(self.id)

    def fixture(self, fixture_id: int) -> PhysicsFixture:
        """Returns the handle of a fixture of the same world by its id, without checking the id."""
        return self.world.fixture(fixture_id)

    @property
    def joints(self) -> list[PhysicsJoint]:
        """Joints attached to the body in order of creation."""
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
        """Adds a circle to the body.

        Args:
            center: Center in the body frame [m].
            radius: Radius, at least 0 [m]; a circle of radius 0 is a point without mass.
            density: Density, at least 0 [kg/m^2].
            friction: Friction coefficient, at least 0.
            restitution: Restitution coefficient, at least 0.
            is_sensor: Whether the fixture detects contacts without responding to them.
            category_bits: Categories of the fixture, 16 bits.
            mask_bits: Categories that the fixture collides with, 16 bits.

        Returns:
            The new fixture.

        Raises:
            ValueError: A number, or the resulting mass of the body, is out of range.
            StaleHandleError: The body was destroyed.
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
        """Adds the convex hull of points to the body.

        Args:
            points: 3 to 8 points in the body frame [m], shape (k, 2). Box2D drops each point that
                is less than 2.5 mm from an earlier one.
            density: Density, at least 0 [kg/m^2].
            friction: Friction coefficient, at least 0.
            restitution: Restitution coefficient, at least 0.
            is_sensor: Whether the fixture detects contacts without responding to them.
            category_bits: Categories of the fixture, 16 bits.
            mask_bits: Categories that the fixture collides with, 16 bits.

        Returns:
            The new fixture.

        Raises:
            ValueError: The array has a wrong shape, fewer than 3 points are distinct, the hull has
                no area, or a number or the resulting mass of the body is out of range.
            StaleHandleError: The body was destroyed.
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
        """Adds two-sided edges to the body, each as a fixture; releases the GIL.

        Args:
            edges: Edges (x1, y1, x2, y2) in the body frame [m], shape (n, 4), float32. Edges
                shorter than 1.2e-7 m have no direction and are skipped; nothing can collide with
                them.
            friction: Friction coefficient, at least 0.
            restitution: Restitution coefficient, at least 0.
            category_bits: Categories of the fixtures, 16 bits.
            mask_bits: Categories that the fixtures collide with, 16 bits.

        Returns:
            The number of edges created.

        Raises:
            ValueError: The array has a wrong shape or a number is out of range; no edge is created.
            StaleHandleError: The body was destroyed.
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

    def set_material(self, material: Material) -> None:
        """Gives all present fixtures of the body a material.

        Raises:
            ValueError: A number is not from 0 to 1, or `transmission` + `specular` is above 1.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self._core.set_body_material(self.id, *material)

    def edges(self) -> FloatArray:
        """Returns the edges (x1, y1, x2, y2) of the body in the body frame [m], shape (n, 4)."""
        return self._core.edges(self.id)
