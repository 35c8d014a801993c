"""A tricycle drive: a steered and driven front wheel and two passive rear wheels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.plugin_api.body_drive import BodyDrive
from flatland.plugin_api.drive import Odometer
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.parameters import read_body, read_choice, read_not_negative
from flatland.plugin_api.traction import read_traction
from flatland.plugin_api.wheel_joint import TOLERANCE, WheelJoint, is_off

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.model import Model
    from flatland.geometry import Vector2
    from flatland.physics import TricycleController

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


class TricycleDrive(BodyDrive):
    """Steers and drives the front wheel as commanded; the body follows without slip.

    The core carries it out in each step (`flatland.physics.TricycleController`).

    Attributes:
        geometry: Positions of the wheels.
    """

    _controller: TricycleController

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters, checks the joints and declares the ports.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        self.body = read_body(config, self.model)
        self._max_steer_angle = config.get("max_steer_angle", "angle", 0.0, minimum=0)
        self.read_limits(config)
        self.geometry = TricycleGeometry(config, self.model, self.body)
        # Unlike the reference: odometry has its own frame, not the frame of the ground truth.
        self._odometer = Odometer(
            self,
            config,
            self.body,
            twist_in_local_frame=False,
            sends_transform=False,
            center=self.geometry.rear_center,
        )
        self.world_frame_id = self._odometer.world_frame_id
        self._twist = None
        # Before the controller: the odometry is that before the wheels are steered.
        self._odometer.publish_at_rate(config, self._publish)
        self._command = self.open_twist(config)
        self.takes_steering = read_choice(config, "command", _COMMANDS) == "steering"
        self._controller = self.control(
            self.body.control_tricycle(
                self.geometry.front_joint,
                steering_sign=self.geometry.steering_sign,
                wheelbase=self.geometry.wheelbase,
                rear_center=self.geometry.rear_center,
                takes_twist=not self.takes_steering,
            )
        )
        self.apply_limits()
        self.traction = read_traction(config, self.body, at_center=True)

    def read_limits(self, config: YamlReader) -> None:
        """Reads the limits, including those of the steering by the keys of older files."""
        super().read_limits(config)
        limits = self.angular_dynamics
        velocity = read_not_negative(config, "max_angular_velocity", 0.0)
        acceleration = read_not_negative(config, "max_steer_acceleration", 0.0)
        if limits.acceleration_limit or not acceleration:
            acceleration, deceleration = limits.acceleration_limit, limits.deceleration_limit
        else:
            deceleration = acceleration
        velocity = limits.velocity_limit or velocity
        self._limits = self.linear_dynamics, DynamicsLimits(velocity, acceleration, deceleration)

    def _set_limits(self, linear: DynamicsLimits, angular: DynamicsLimits) -> None:
        self._controller.set_limits(linear.as_tuple(), angular.as_tuple(), self._max_steer_angle)

    @property
    def max_steer_angle(self) -> float:
        """Largest steering angle [rad], 0 for no limit; settable."""
        return self._max_steer_angle

    @max_steer_angle.setter
    def max_steer_angle(self, angle: float) -> None:
        self._max_steer_angle = angle
        self.apply_limits()

    # -- state, which the core has ---------------------------------------------------------

    @property
    def steering_angle(self) -> float:
        """Angle of the front wheel, counter-clockwise [rad]."""
        return self._controller.state[0]

    @property
    def steering_velocity(self) -> float:
        """Rate of change of the steering angle [rad/s]."""
        return self._controller.state[1]

    @property
    def front_velocity(self) -> float:
        """Speed of the front wheel along its heading [m/s]."""
        return self._controller.state[2]

    def set_target(self) -> None:
        """Passes the command to the controller."""
        command = self._command.value
        self._controller.set_target(command.linear_x, command.angular_z)

    def drive_state(self) -> tuple[object, ...]:
        """Returns the state of the front wheel."""
        *wheel, target_angle = self._controller.state
        return (tuple(wheel), target_angle)
