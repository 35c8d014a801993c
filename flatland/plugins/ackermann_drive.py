"""A car: two steered front wheels and a driven rear axle."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flatland.config.hints import degrees
from flatland.plugin_api.body_drive import BodyDrive
from flatland.plugin_api.drive import CommandGuard
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.parameters import at_key, read_body, read_choice, read_point, read_positive
from flatland.plugin_api.traction import read_traction
from flatland.plugin_api.wheel_joint import WheelJoint, is_off
from flatland.values import AckermannCommand, Twist

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.joint import Joint
    from flatland.entities.model import Model
    from flatland.geometry import Vector2
    from flatland.physics import AckermannController
    from flatland.plugin_api.ports import Command

_COMMANDS = ("twist", "steering", "ackermann")
_JOINTS = (
    "front_left_wheel_joint",
    "front_right_wheel_joint",
    "rear_left_wheel_joint",
    "rear_right_wheel_joint",
)
_LARGEST_ANGLE = math.radians(89.0)


@dataclass(frozen=True, slots=True)
class CarGeometry:
    """The positions of the wheels of a car.

    Attributes:
        wheelbase: Distance of the axles [m].
        track: Distance of the front wheels, 0 without joints [m].
        rear_center: Centre of the rear axle, body frame [m].
        front_joints: Joints of the left and the right front wheel, each with the sign of its angle
            if the wheel is steered to the left; empty without joints.
    """

    wheelbase: float
    track: float
    rear_center: Vector2
    front_joints: tuple[tuple[Joint, float], ...] = ()

    @classmethod
    def from_config(cls, config: YamlReader, model: Model, body: Body) -> CarGeometry:
        """Reads the positions: of four joints, or `wheelbase` and `rear_axle`.

        Raises:
            YamlError: A parameter is missing or invalid.
        """
        if not any(key in config for key in _JOINTS):
            wheelbase = read_positive(config, "wheelbase")
            return cls(wheelbase, 0.0, read_point(config, "rear_axle"))
        wheels = [WheelJoint(config, key, model) for key in _JOINTS]
        for wheel, key in zip(wheels, _JOINTS, strict=True):
            kind = "revolute" if key.startswith("front") else "weld"
            wheel.check_type(kind, f'The joint of "{key}" must be a {kind} joint')
        anchors = [wheel.body_anchor(body) for wheel in wheels]
        (front_x, left_y), front_right, (rear_x, rear_left_y), rear_right = anchors
        for left, right, axle in ((0, 1, "front"), (2, 3, "rear")):
            if is_off((anchors[left][0], 0.0), (anchors[right][0], 0.0)):
                raise wheels[right].error(f"The wheels of the {axle} axle must have the same x")
            if anchors[left][1] <= anchors[right][1]:
                raise wheels[left].error(f"The left wheel of the {axle} axle must have a greater y")
        middle = (left_y + front_right[1]) / 2
        if is_off((0.0, middle), (0.0, (rear_left_y + rear_right[1]) / 2)):
            raise wheels[0].error("The centres of both axles must have the same y")
        if front_x <= rear_x:
            raise wheels[0].error("The front axle must have a greater x than the rear axle")
        return cls(
            front_x - rear_x,
            left_y - front_right[1],
            (rear_x, middle),
            tuple((wheel.joint, wheel.steering_sign(body)) for wheel in wheels[:2]),
        )


class AckermannDrive(BodyDrive):
    """Steers and drives a car as commanded; the body follows without slip.

    The core carries it out in each step (`flatland.physics.AckermannController`).

    Attributes:
        geometry: Positions of the wheels.
        max_steer_angle: Largest steering angle [rad].
    """

    _controller: AckermannController

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters, checks the joints and declares the ports.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        self.body = read_body(config, self.model)
        self.max_steer_angle = config.get("max_steer_angle", "float", finite=True)
        if not 0.0 < self.max_steer_angle <= _LARGEST_ANGLE:
            raise at_key(config, "max_steer_angle").error(
                f'Invalid "max_steer_angle", must be above 0 and at most {_LARGEST_ANGLE:.3f}, '
                f"got {self.max_steer_angle}",
                degrees(self.max_steer_angle),
            )
        self.read_limits(config)
        self.geometry = CarGeometry.from_config(config, self.model, self.body)
        kind = self._read_command_type(config)
        self.takes_steering = kind != "twist"
        self._controller = self.control(
            self.body.control_ackermann(
                wheelbase=self.geometry.wheelbase,
                track=self.geometry.track,
                rear_center=self.geometry.rear_center,
                front_joints=self.geometry.front_joints,
                takes_twist=not self.takes_steering,
            )
        )
        self.apply_limits()
        self.traction = read_traction(config, self.body, at_center=True)
        self.open_reports(config, self.geometry.rear_center)
        self._twist_command: Command[Twist] | None = None
        self._ackermann_command: Command[AckermannCommand] | None = None
        if kind == "ackermann":
            topic = config.get("ackermann_sub", "string", "ackermann_cmd")
            guard: CommandGuard[AckermannCommand] = CommandGuard.of(self)
            self._ackermann_command = self.command(topic, AckermannCommand, accept=guard)
            self._ackermann_command.on_change = self.command_changed
        else:
            self._twist_command = self.open_twist(config)

    def _read_command_type(self, config: YamlReader) -> str:
        kind = read_choice(config, "command", _COMMANDS)
        if kind == "ackermann" and self.ros is not None and not _has_messages():
            raise at_key(config, "command").error(
                'Invalid "command", ackermann requires the ROS package ackermann_msgs, which is '
                "not installed; twist and steering use geometry_msgs/Twist"
            )
        return kind

    def _set_limits(self, linear: DynamicsLimits, angular: DynamicsLimits) -> None:
        self._controller.set_limits(linear.as_tuple(), angular.as_tuple(), self.max_steer_angle)

    @property
    def steering_angle(self) -> float:
        """Steering angle of the middle of the front axle, counter-clockwise [rad]."""
        return self._controller.state[0]

    @property
    def speed(self) -> float:
        """Commanded speed of the centre of the rear axle within the limits [m/s]."""
        return self._controller.state[2]

    def set_target(self) -> None:
        """Passes the command to the controller, with the limits that it contains."""
        if self._twist_command is not None:
            twist = self._twist_command.value
            self._controller.set_target(twist.linear_x, twist.angular_z)
        elif self._ackermann_command is not None:
            command = self._ackermann_command.value
            self._controller.set_target(
                command.speed,
                command.steering_angle,
                command.acceleration,
                command.steering_angle_velocity,
            )

    def drive_state(self) -> tuple[object, ...]:
        """Returns the state of the steering and the speed."""
        return self._controller.state


def _has_messages() -> bool:
    return importlib.util.find_spec("ackermann_msgs") is not None
