"""Handles of rigid bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy.typing as npt

from flatland.geometry import FloatArray, Pose, Vector2
from flatland.physics.controller import (
    NO_LIMITS,
    AckermannController,
    OmniController,
    PathController,
    SpeedLimits,
    TricycleController,
    TweenController,
    VelocityController,
)
from flatland.physics.fixture import ALL_BITS
from flatland.physics.handle import Handle

if TYPE_CHECKING:
    from flatland.physics.fixture import PhysicsFixture
    from flatland.physics.joint import PhysicsJoint
    from flatland.physics.material import Material


class PhysicsBody(Handle):
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

    def control_velocity(
        self,
        linear: SpeedLimits = NO_LIMITS,
        angular: SpeedLimits = NO_LIMITS,
        *,
        holonomic: bool = True,
    ) -> VelocityController:
        """Creates a controller that sets the velocity of the body in its own frame in each step.

        The core carries it out before the hooks of plugins, in a tenth of the time of a hook that
        calls `set_velocity`. The commanded velocity is initially 0.

        Args:
            linear: Limits of the forward and sideways velocity [m/s], acceleration and deceleration
                [m/s²]; 0 for no limit.
            angular: Limits of the angular velocity [rad/s], acceleration and deceleration
                [rad/s²]; 0 for no limit.
            holonomic: Whether the body can move sideways.

        Returns:
            The controller, which sets the commanded velocity.

        Raises:
            ValueError: A limit is negative or NaN.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        controller = VelocityController(
            self.world, self._core.add_twist_controller(self.id, holonomic)
        )
        try:
            controller.set_limits(linear, angular)
        except BaseException:
            controller.remove()
            raise
        controller.schedule(0, automatic=True)
        self.world.plan.is_used = True
        return controller

    def control_tricycle(
        self,
        front_joint: PhysicsJoint,
        *,
        steering_sign: float,
        wheelbase: float,
        rear_center: Vector2,
        takes_twist: bool,
    ) -> TricycleController:
        """Creates a controller of a tricycle, which is not carried out automatically yet.

        Args:
            front_joint: Revolute joint of the steered wheel at the origin of the body; its limits
                are set to the steering angle.
            steering_sign: Sign of the angle of the joint if the wheel is steered to the left.
            wheelbase: Distance from the rear center to the front wheel [m].
            rear_center: Midpoint of the rear wheels in the frame of the body [m].
            takes_twist: Whether commands are velocities of the rear center and yaw rates.

        Raises:
            ValueError: The wheelbase is not positive.
            StaleHandleError: The body or the joint was destroyed.
            WorldLockedError: The world is stepping.
        """
        self.world.plan.is_used = True
        controller = self._core.add_tricycle_controller(
            self.id, front_joint.id, steering_sign, wheelbase, rear_center, takes_twist
        )
        return TricycleController(self.world, controller)

    def control_tween(
        self, delta: Pose, *, duration: float, mode: str, easing: str
    ) -> TweenController:
        """Creates a controller of a prescribed motion, which is not carried out automatically yet.

        Args:
            delta: Offset of the other end from the current pose [m, rad].
            duration: Duration of the motion to the other end [s].
            mode: `yoyo`, `loop`, `once` or `trigger`.
            easing: Name of the easing curve.

        Raises:
            ValueError: An argument is invalid.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self.world.plan.is_used = True
        controller = self._core.add_tween_controller(self.id, delta, duration, mode, easing)
        return TweenController(self.world, controller)

    def control_ackermann(
        self,
        *,
        wheelbase: float,
        track: float,
        rear_center: Vector2,
        front_joints: Sequence[tuple[PhysicsJoint, float]],
        takes_twist: bool,
    ) -> AckermannController:
        """Creates a controller of a car, which is not carried out automatically yet.

        Args:
            wheelbase: Distance of the axles [m].
            track: Distance of the front wheels [m].
            rear_center: Centre of the rear axle in the frame of the body [m].
            front_joints: Revolute joints of the left and the right front wheel, each with the sign
                of its angle if the wheel is steered to the left; may be empty. Their limits are set
                to the angles of the wheels.
            takes_twist: Whether commands are velocities of the rear center and yaw rates.

        Raises:
            ValueError: An argument is invalid.
            StaleHandleError: The body or a joint was destroyed.
            WorldLockedError: The world is stepping.
        """
        self.world.plan.is_used = True
        joints = [(joint.id, sign) for joint, sign in front_joints]
        controller = self._core.add_ackermann_controller(
            self.id, wheelbase, track, rear_center, joints, takes_twist
        )
        return AckermannController(self.world, controller)

    def control_omni(
        self, wheels: Sequence[Pose], *, wheel_speed: float, wheel_acceleration: float
    ) -> OmniController:
        """Creates a controller of a holonomic drive, which is not carried out automatically yet.

        Args:
            wheels: For each wheel, the factors of the velocity (forward, sideways, omega) of the
                body in the speed at which its rim rolls.
            wheel_speed: Largest speed of the rims [m/s], 0 for no limit.
            wheel_acceleration: Largest acceleration of the rims [m/s²], 0 for no limit.

        Raises:
            ValueError: A limit is negative or NaN.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self.world.plan.is_used = True
        controller = self._core.add_omni_controller(
            self.id, list(wheels), wheel_speed, wheel_acceleration
        )
        return OmniController(self.world, controller)

    def control_path(
        self,
        waypoints: Sequence[Pose],
        *,
        mode: str,
        faces_forward: bool,
        linear: SpeedLimits,
        angular: SpeedLimits,
        wait: float,
        key: int,
    ) -> PathController:
        """Creates a controller of a motion along waypoints, which is not carried out yet.

        Args:
            waypoints: Poses after the current pose of the body, world frame [m, rad].
            mode: `loop`, `once`, `there_and_back` or `random`.
            faces_forward: Whether the body turns towards the next waypoint and then drives there;
                otherwise it reaches the angle of a waypoint on the way.
            linear: Limits of speed [m/s], which is above 0, acceleration and deceleration [m/s²].
            angular: The same of the rotation [rad/s, rad/s²].
            wait: Time at each waypoint [s].
            key: Key of the random numbers of mode `random`, from 0 to 2^64 - 1.

        Raises:
            ValueError: An argument is invalid.
            StaleHandleError: The body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self.world.plan.is_used = True
        controller = self._core.add_path_controller(
            self.id, list(waypoints), mode, faces_forward, linear, angular, wait, key
        )
        return PathController(self.world, controller)

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
