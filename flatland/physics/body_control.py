"""Creation of the controllers of a body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from flatland.geometry import Pose, Vector2
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
from flatland.physics.handle import Handle

if TYPE_CHECKING:
    from flatland.physics.joint import PhysicsJoint


class BodyControl(Handle):
    """The part of `PhysicsBody` that creates controllers, which set its motion in each step."""

    __slots__ = ()

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
