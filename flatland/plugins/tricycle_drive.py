"""A tricycle drive: a steered and driven front wheel and two passive rear wheels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.plugin_api.drive import Odometer, open_twist_command
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.parameters import at_key, read_body, read_not_negative
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.schedule import when_due
from flatland.plugin_api.traction import read_traction
from flatland.plugin_api.wheel_joint import TOLERANCE, WheelJoint, is_off

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.model import Model
    from flatland.geometry import Pose, Vector2
    from flatland.timekeeper import Timekeeper

_COMMANDS = ("steering", "twist")


class TricycleGeometry:
    """The wheel positions of a tricycle, taken from its joints.

    Attributes:
        front_joint: The revolute joint of the steered wheel.
        steering_sign: Sign of the angle of the front joint if the wheel is steered to the left.
        rear_center: Midpoint between the rear wheels, body frame [m].
        wheelbase: Distance from the rear center to the front wheel [m].
    """

    def __init__(self, config: YamlReader, model: Model, body: Body) -> None:
        """Reads the names of the joints and checks them.

        Args:
            config: The plugin's parameters.
            model: Model of the joints.
            body: Body on which the wheels are mounted.

        Raises:
            YamlError: A joint does not exist, or its type or anchors are invalid.
        """
        front = WheelJoint(config, "front_wheel_joint", model)
        rear_left = WheelJoint(config, "rear_left_wheel_joint", model)
        rear_right = WheelJoint(config, "rear_right_wheel_joint", model)
        front.check_type("revolute", "Front wheel joint must be a revolute joint")
        rear_left.check_type("weld", "Rear left wheel joint must be a weld joint")
        rear_right.check_type("weld", "Rear right wheel joint must be a weld joint")
        front_anchor = front.body_anchor(body)
        left_anchor = rear_left.body_anchor(body)
        right_anchor = rear_right.body_anchor(body)
        if is_off(front_anchor, (0.0, 0.0)):
            raise front.error("Front wheel joint must have its body anchored at (0, 0)")
        self.front_joint = front.joint
        self.steering_sign = front.steering_sign(body)
        self.rear_center = (
            (left_anchor[0] + right_anchor[0]) / 2,
            (left_anchor[1] + right_anchor[1]) / 2,
        )
        if not is_off(left_anchor, right_anchor):
            raise rear_left.error("The rear wheel joints must not have the same anchor")
        if is_off(self.rear_center, _foot(front_anchor, left_anchor, right_anchor)):
            raise rear_left.error(
                "The mid point between the rear wheel anchors on the body must equal the "
                "perpendicular intersection between the rear axel (line segment between rear "
                "anchors) and the front wheel anchor"
            )
        self.wheelbase = math.dist(front_anchor, self.rear_center)
        if self.wheelbase <= TOLERANCE:
            raise front.error("The front wheel joint must not be anchored on the rear axle")


def _foot(point: Vector2, start: Vector2, end: Vector2) -> Vector2:
    """Returns the foot of the perpendicular from a point to the line through two others."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    along = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / (dx * dx + dy * dy)
    return (start[0] + along * dx, start[1] + along * dy)


class TricycleDrive(ModelPlugin):
    """Steers and drives the front wheel as commanded; the body follows without slip.

    The core carries it out in each step (`flatland.physics.TricycleController`).

    Attributes:
        geometry: Positions of the wheels.
        traction: Limits of the forces in mode `force`; None in mode `velocity`.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters, checks the joints and declares the ports.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        self.body = read_body(config, self.model)
        self._max_steer_angle = read_not_negative(config, "max_steer_angle", 0.0)
        self._linear_dynamics = DynamicsLimits.from_config(
            config.optional_subnode("linear_dynamics", "map")
        )
        self._angular_dynamics = self._read_angular_dynamics(config)
        self.geometry = TricycleGeometry(config, self.model, self.body)
        # Unlike the reference: odometry has its own frame, not that of the ground truth.
        self._odometer = Odometer(
            self,
            config,
            self.body,
            twist_in_local_frame=False,
            sends_transform=False,
            center=self.geometry.rear_center,
        )
        self.world_frame_id = self._odometer.world_frame_id
        self.timer = self._odometer.schedule(config, self._publish_now)
        self._command = open_twist_command(self, config.get("twist_sub", "string", "cmd_vel"))
        self._command.on_change = self._command_changed
        self._controller = self.control(
            self.body.control_tricycle(
                self.geometry.front_joint,
                steering_sign=self.geometry.steering_sign,
                wheelbase=self.geometry.wheelbase,
                rear_center=self.geometry.rear_center,
                takes_twist=self._read_command_type(config) == "twist",
            )
        )
        self._set_limits()
        self.traction = read_traction(config, self.body, self._controller, at_center=True)

    @staticmethod
    def _read_command_type(config: YamlReader) -> str:
        kind: str = config.get("command", "string", "steering")
        if kind not in _COMMANDS:
            raise at_key(config, "command").error(
                f'Invalid "command", must be one of: {", ".join(_COMMANDS)}, got {kind}'
            )
        return kind

    @staticmethod
    def _read_angular_dynamics(config: YamlReader) -> DynamicsLimits:
        """Reads the limits of the steering, including the keys of older files."""
        limits = DynamicsLimits.from_config(config.optional_subnode("angular_dynamics", "map"))
        velocity = read_not_negative(config, "max_angular_velocity", 0.0)
        acceleration = read_not_negative(config, "max_steer_acceleration", 0.0)
        if limits.acceleration_limit or not acceleration:
            acceleration, deceleration = limits.acceleration_limit, limits.deceleration_limit
        else:
            deceleration = acceleration
        return DynamicsLimits(limits.velocity_limit or velocity, acceleration, deceleration)

    # -- limits and state, which the core has ----------------------------------------------

    @property
    def linear_dynamics(self) -> DynamicsLimits:
        """Limits of the front wheel; settable."""
        return self._linear_dynamics

    @linear_dynamics.setter
    def linear_dynamics(self, limits: DynamicsLimits) -> None:
        self._linear_dynamics = limits
        self._set_limits()

    @property
    def angular_dynamics(self) -> DynamicsLimits:
        """Limits of the steering angle; settable."""
        return self._angular_dynamics

    @angular_dynamics.setter
    def angular_dynamics(self, limits: DynamicsLimits) -> None:
        self._angular_dynamics = limits
        self._set_limits()

    @property
    def max_steer_angle(self) -> float:
        """Largest steering angle [rad], 0 for no limit; settable."""
        return self._max_steer_angle

    @max_steer_angle.setter
    def max_steer_angle(self, angle: float) -> None:
        self._max_steer_angle = angle
        self._set_limits()

    def _set_limits(self) -> None:
        self._controller.set_limits(
            self._linear_dynamics.as_tuple(),
            self._angular_dynamics.as_tuple(),
            self._max_steer_angle,
        )

    @property
    def steering_angle(self) -> float:
        """Angle of the front wheel, counter-clockwise [rad]; settable."""
        return self._controller.state[0]

    @steering_angle.setter
    def steering_angle(self, angle: float) -> None:
        self._controller.state = (angle, *self._controller.state[1:])

    @property
    def steering_velocity(self) -> float:
        """Rate of change of the steering angle [rad/s]; settable."""
        return self._controller.state[1]

    @steering_velocity.setter
    def steering_velocity(self, velocity: float) -> None:
        angle, _, speed, target = self._controller.state
        self._controller.state = (angle, velocity, speed, target)

    @property
    def front_velocity(self) -> float:
        """Speed of the front wheel along its heading [m/s]; settable."""
        return self._controller.state[2]

    @front_velocity.setter
    def front_velocity(self, velocity: float) -> None:
        angle, steering_velocity, _, target = self._controller.state
        self._controller.state = (angle, steering_velocity, velocity, target)

    def _command_changed(self) -> None:
        self.set_before_step(self._set_target)

    def _set_target(self) -> None:
        command = self._command.value
        self._controller.set_target(command.linear_x, command.angular_z)

    # -- steps -----------------------------------------------------------------------------

    @when_due
    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Emits the odometry if an update is due, then steers and sets the velocity of the body."""
        if self.timer.check_update(timekeeper):
            self._publish(timekeeper.sim_time_ns, self.body.pose)
        self._set_target()
        self._controller.advance(timekeeper.step_size)

    def model_moved(self, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Keeps the odometry, or displaces it along with the model."""
        self._odometer.move(previous[self.body.name], keep_odometry)
        if self.traction is not None:
            self._controller.release_brakes()

    def state(self) -> object:
        """Returns the state of the front wheel and of the odometry."""
        *wheel, target_angle = self._controller.state
        state = (tuple(wheel), target_angle, self._odometer.state())
        return state if self.traction is None else (*state, self._controller.traction_state)

    def _publish_now(self, timekeeper: Timekeeper) -> None:
        self._publish(timekeeper.sim_time_ns, self.body.pose)

    def _publish(self, stamp: int, pose: Pose) -> None:
        odometer = self._odometer
        odometer.begin_update()
        if odometer.wanted or odometer.sends_transform:
            odometer.report(stamp, pose, self.body.velocity)
