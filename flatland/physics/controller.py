"""Handles of controllers, which move bodies in each step without a call from outside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from flatland import _core
from flatland.geometry import Pose, Vector2
from flatland.physics.handle import Handle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from flatland.physics.body import PhysicsBody

SpeedLimits = tuple[float, float, float]
"""Limits of velocity, acceleration and deceleration; 0 for no limit."""

NO_LIMITS: SpeedLimits = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class RollingWheel:
    """A wheel on the ground.

    Attributes:
        body: Body on which the wheel is mounted.
        position: Point of the body at which the wheel touches the ground, body frame [m].
        heading: Direction in which the wheel rolls, body frame [rad].
        radius: Radius of the wheel [m].
        slide: Cotangent of the angle from the heading to the direction in which the wheel moves
            freely: 0 for wheels that slide sideways, 1 or -1 for mecanum wheels.
    """

    body: PhysicsBody
    position: Vector2
    heading: float
    radius: float
    slide: float


class Controller(Handle):
    """Handle of a controller; created by a method of a body.

    All members except `alive` raise `StaleHandleError` once the controller is removed or its body
    is destroyed.

    Attributes:
        id: Id of the controller, never reused in its world.
        world: Physics world that contains the controller.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the controller exists."""
        return self._core.has_controller(self.id)

    def remove(self) -> None:
        """Removes the controller; the body keeps its velocity.

        Raises:
            StaleHandleError: The controller has already been removed.
            WorldLockedError: The world is stepping.
        """
        self._core.remove_controller(self.id)

    def schedule(self, order: int, *, automatic: bool, holds: bool = False) -> None:
        """Sets when the controller is carried out.

        Args:
            order: In each step, controllers are carried out in ascending order. That of a plugin
                is its place in the order of hooks, from 1 on.
            automatic: Whether each step of a `World` carries out the controller; otherwise, only
                `advance` does.
            holds: Whether each step of a `World` also reverts the effect of the physics step, if
                the motion of the body is prescribed.
        """
        self._core.schedule_controller(self.id, order, automatic, holds)

    def advance(self, dt: float) -> None:
        """Carries out the controller now, and not again in the current step.

        Args:
            dt: Duration of the step [s].

        Raises:
            ValueError: The new velocity or pose of the body is out of range.
            StaleHandleError: The controller was removed.
            WorldLockedError: The world is stepping.
        """
        self._core.advance_controller(self.id, dt)


class DriveController(Controller):
    """Handle of the controller of a drive, which sets velocities or applies forces."""

    __slots__ = ()

    def set_traction(
        self,
        bodies: Iterable[PhysicsBody],
        *,
        holonomic: bool,
        at_center: bool,
        max_force: float,
        max_torque: float,
        grip: float,
        radius: float,
    ) -> None:
        """Makes the drive push its body with bounded forces instead of setting the velocity.

        Args:
            bodies: The driven body, and those that move with it as if they were rigid.
            holonomic: Whether the motors push in all directions, or only forwards and backwards.
            at_center: Whether the forces act at the common centre of mass, as those of a car, or at
                the origin of the body, as those of a single axle.
            max_force: Force of the motors [N].
            max_torque: Torque of the motors [N m].
            grip: Friction coefficient on the ground times gravity [m/s²]; may be infinite.
            radius: Radius at which the friction acts [m], 0 for the radius of gyration.

        Raises:
            ValueError: A limit is negative or NaN, or the body is not dynamic.
            StaleHandleError: The controller was removed, or a body destroyed.
            WorldLockedError: The world is stepping.
        """
        ids = [body.id for body in bodies]
        self._core.set_traction(
            self.id, ids, holonomic, at_center, max_force, max_torque, grip, radius
        )

    def release_brakes(self) -> None:
        """Makes the brakes hold the pose at the next step, for a body that was moved."""
        self._core.release_brakes(self.id)

    @property
    def traction_state(self) -> tuple[float, bool, tuple[float, float, float]]:
        """Part of the limits that the last step required, and the pose that the brakes hold.

        The part is above 1 if the drive slipped or stalled. The second value is whether the drive
        is braked.
        """
        return self._core.traction_state(self.id)


class VelocityController(DriveController):
    """Moves the origin of a body with a velocity in the frame of the body, before each step.

    A velocity is (forward, sideways, omega) [m/s, rad/s]. It is set in every step, so that
    friction, damping and contacts do not slow the body down.
    """

    __slots__ = ()

    @property
    def target(self) -> Pose:
        """The commanded velocity."""
        return self._core.twist_target(self.id)

    def set_target(self, forward: float, sideways: float, omega: float) -> None:
        """Sets the commanded velocity, from the next step on."""
        self._core.set_twist_target(self.id, forward, sideways, omega)

    @property
    def velocity(self) -> Pose:
        """The commanded velocity within the limits, as of the last step."""
        return self._core.twist_velocity(self.id)

    def set_velocity(self, forward: float, sideways: float, omega: float) -> None:
        """Sets the velocity from which the limits of acceleration are applied."""
        self._core.set_twist_velocity(self.id, forward, sideways, omega)

    def set_limits(self, linear: SpeedLimits, angular: SpeedLimits) -> None:
        """Sets limits of velocity [m/s, rad/s], acceleration and deceleration.

        Args:
            linear: Limits of the forward velocity, and of the sideways velocity.
            angular: Limits of the angular velocity.

        Raises:
            ValueError: A limit is negative or NaN.
        """
        self._core.set_twist_limits(self.id, linear, angular)


class TricycleController(DriveController):
    """Steers and drives the front wheel of a body, which follows without slip, before each step.

    The state is (steering angle [rad], steering velocity [rad/s], speed of the front wheel [m/s],
    steering angle that the last command required [rad]).
    """

    __slots__ = ()

    def set_target(self, linear: float, angular: float) -> None:
        """Sets the command, from the next step on.

        Args:
            linear: Speed of the front wheel; of the rear center if the drive takes a twist [m/s].
            angular: Steering angle [rad]; the yaw rate if the drive takes a twist [rad/s].
        """
        self._core.set_tricycle_target(self.id, linear, angular)

    def set_limits(self, linear: SpeedLimits, angular: SpeedLimits, max_angle: float) -> None:
        """Sets limits of velocity, acceleration and deceleration.

        Args:
            linear: Limits of the front wheel [m/s].
            angular: Limits of the steering angle [rad/s].
            max_angle: Largest steering angle [rad], 0 for no limit.

        Raises:
            ValueError: A limit is negative or NaN.
        """
        self._core.set_tricycle_limits(self.id, linear, angular, max_angle)

    @property
    def state(self) -> tuple[float, float, float, float]:
        """The state; settable."""
        return self._core.tricycle_state(self.id)

    @state.setter
    def state(self, state: tuple[float, float, float, float]) -> None:
        self._core.set_tricycle_state(self.id, *state)


class AckermannController(DriveController):
    """Steers and drives a car, which follows without slip, before each step.

    The car is a single track: the steering angle is that of a wheel between the front wheels.
    """

    __slots__ = ()

    def set_target(self, speed: float, angular: float) -> None:
        """Sets the command, from the next step on.

        Args:
            speed: Speed of the centre of the rear axle [m/s].
            angular: Steering angle [rad]; the yaw rate if the drive takes a twist [rad/s].
        """
        self._core.set_ackermann_target(self.id, speed, angular)

    def set_limits(self, linear: SpeedLimits, angular: SpeedLimits, max_angle: float) -> None:
        """Sets limits of velocity, acceleration and deceleration.

        Args:
            linear: Limits of the speed [m/s].
            angular: Limits of the steering angle [rad/s].
            max_angle: Largest steering angle [rad].

        Raises:
            ValueError: A limit is negative or NaN, or the angle is not between 0 and 90 degrees.
        """
        self._core.set_ackermann_limits(self.id, linear, angular, max_angle)

    @property
    def state(self) -> tuple[float, float, float, float]:
        """Steering angle [rad], its rate [rad/s], speed [m/s] and commanded angle [rad]."""
        return self._core.ackermann_state(self.id)


class OmniController(DriveController):
    """Moves the origin of a body in all directions, within limits of its wheels.

    The velocity (forward, sideways, omega) [m/s, rad/s] changes along a straight line.
    """

    __slots__ = ()

    def set_target(self, forward: float, sideways: float, omega: float) -> None:
        """Sets the commanded velocity, from the next step on."""
        self._core.set_omni_target(self.id, forward, sideways, omega)

    def set_limits(self, linear: SpeedLimits, angular: SpeedLimits) -> None:
        """Sets limits of velocity [m/s, rad/s], acceleration and deceleration.

        Args:
            linear: Limits of the speed, and of the acceleration along each axis of the body.
            angular: Limits of the angular velocity.

        Raises:
            ValueError: A limit is negative or NaN.
        """
        self._core.set_omni_limits(self.id, linear, angular)

    @property
    def velocity(self) -> Pose:
        """The commanded velocity within the limits, as of the last step."""
        return self._core.omni_velocity(self.id)


class PathController(Controller):
    """Moves a body along waypoints, before and after each step."""

    __slots__ = ()

    def set_start(self, is_started: bool, starts: int) -> None:
        """Sets whether the body moves, from the next step on.

        Args:
            is_started: Whether it moves; otherwise it stops at the next waypoint.
            starts: Number of commands to start so far.
        """
        self._core.set_path_start(self.id, is_started, starts)

    def set_key(self, key: int) -> None:
        """Sets the key of the random numbers, from 0 to 2^64 - 1."""
        self._core.set_path_key(self.id, key)

    def restart(self) -> None:
        """Continues from the current pose of the body, which was moved."""
        self._core.restart_path(self.id)

    def hold(self) -> None:
        """Moves the body to its pose on the path, after the physics step.

        Raises:
            ValueError: The pose is out of range.
            StaleHandleError: The controller was removed.
            WorldLockedError: The world is stepping.
        """
        self._core.hold_controller(self.id)

    @property
    def state(
        self,
    ) -> tuple[
        int,
        int,
        bool,
        bool,
        int,
        float,
        int,
        tuple[float, float, float],
        tuple[float, float, float],
        int,
    ]:
        """Everything that changes.

        Last waypoint reached, next one, whether the body moves, whether it moves forwards along the
        path, number of legs begun, time of the leg [s], number of starts used, pose, pose at the
        beginning of the leg [m, rad], key of the random numbers. Waypoint 0 is the initial pose.
        """
        return self._core.path_state(self.id)


class WheelsController(Controller):
    """Measures how far wheels roll, after each step."""

    __slots__ = ()

    def measure(self) -> None:
        """Adds the motion since the last measurement; called by the core after each step."""
        self._core.hold_controller(self.id)

    def skip(self) -> None:
        """Makes the next measurement start from the current poses."""
        self._core.skip_wheel_motion(self.id)

    @property
    def states(self) -> list[tuple[float, float]]:
        """Angle [rad] and speed [rad/s] of each wheel, positive if it rolls forwards."""
        return self._core.wheel_states(self.id)


class TweenController(Controller):
    """Moves a body between its initial pose and a pose at an offset, before and after each step."""

    __slots__ = ()

    def set_trigger(self, is_triggered: bool) -> None:
        """Sets the direction of the motion in mode `trigger`, from the next step on."""
        self._core.set_tween_trigger(self.id, is_triggered)

    def hold(self) -> None:
        """Reverts the effect of the physics step on the body.

        Raises:
            ValueError: The pose is out of range.
            StaleHandleError: The controller was removed.
            WorldLockedError: The world is stepping.
        """
        self._core.hold_controller(self.id)

    @property
    def state(self) -> tuple[float, float, bool]:
        """Progress in 32 bits, exact progress, and whether the motion is forward."""
        return self._core.tween_state(self.id)


def ease(easing: str, p: float) -> float:
    """Returns the fraction of the path that an easing curve covers at some progress.

    Raises:
        ValueError: The easing does not exist.
    """
    return _core.ease(easing, p)


def easings() -> list[str]:
    """Returns the names of all easing curves."""
    return _core.easings()
