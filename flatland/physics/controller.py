"""Handles of controllers, which move bodies in each step without a call from outside."""

from __future__ import annotations

from flatland import _core
from flatland.geometry import Pose
from flatland.physics.handle import Handle

SpeedLimits = tuple[float, float, float]
"""Limits of velocity, acceleration and deceleration; 0 for no limit."""

NO_LIMITS: SpeedLimits = (0.0, 0.0, 0.0)


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


class VelocityController(Controller):
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


class TricycleController(Controller):
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
