"""Handles of controllers, which move bodies in each step without a call from outside."""

from __future__ import annotations

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

    def schedule(self, order: int, *, automatic: bool) -> None:
        """Sets when the controller is carried out.

        Args:
            order: In each step, controllers are carried out in ascending order. That of a plugin
                is its place in the order of hooks, from 1 on.
            automatic: Whether each step of a `World` carries out the controller; otherwise, only
                `advance` does.
        """
        self._core.schedule_controller(self.id, order, automatic)

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
