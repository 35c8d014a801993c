"""A holonomic drive, with the limits of mecanum or omni wheels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.plugin_api.body_drive import BodyDrive
from flatland.plugin_api.parameters import (
    at_key,
    read_body,
    read_choice,
    read_not_negative,
    read_positive,
)
from flatland.plugin_api.traction import read_traction
from flatland.plugin_api.wheels import GroundWheel, mecanum_wheels, three_wheels

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.physics import OmniController
    from flatland.plugin_api.dynamics_limits import DynamicsLimits

_LAYOUTS = ("none", "mecanum", "three_wheel")


class OmniDrive(BodyDrive):
    """Moves the origin of a body with the commanded velocity in all directions.

    The core carries it out in each step (`flatland.physics.OmniController`).

    Attributes:
        wheels: The wheels whose speeds and accelerations are limited; may be empty.
    """

    _controller: OmniController
    is_holonomic = True

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the ports.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        self.body = read_body(config, self.model)
        self.read_limits(config)
        self.wheels = _read_wheels(config)
        speed, acceleration = (
            self._read_wheel_limit(config, f"max_wheel_{quantity}")
            for quantity in ("speed", "acceleration")
        )
        rows = [wheel.row() for wheel in self.wheels]
        self._controller = self.control(
            self.body.control_omni(rows, wheel_speed=speed, wheel_acceleration=acceleration)
        )
        self.apply_limits()
        self.traction = read_traction(config, self.body, holonomic=True, needs_torque=True)
        self.open_reports(config)
        self._command = self.open_twist(config)

    def _set_limits(self, linear: DynamicsLimits, angular: DynamicsLimits) -> None:
        self._controller.set_limits(linear.as_tuple(), angular.as_tuple())

    def _read_wheel_limit(self, config: YamlReader, key: str) -> float:
        limit = read_not_negative(config, key, 0.0)
        if key in config and not self.wheels:
            raise at_key(config, key).error(f'"{key}" requires a "layout" with wheels')
        return 0.0 if math.isinf(limit) else limit

    @property
    def velocity(self) -> Pose:
        """Commanded velocity (forward, sideways, omega) within the limits [m/s, rad/s]."""
        return self._controller.velocity

    @property
    def wheel_speeds(self) -> tuple[float, ...]:
        """Speeds of the rims of the wheels at this velocity [m/s]."""
        velocity = self._controller.velocity
        return tuple(
            sum(a * b for a, b in zip(wheel.row(), velocity, strict=True)) for wheel in self.wheels
        )

    def set_target(self) -> None:
        """Passes the command to the controller."""
        command = self._command.value
        self._controller.set_target(command.linear_x, command.linear_y, command.angular_z)

    def drive_state(self) -> tuple[object, ...]:
        """Returns the commanded velocity within the limits."""
        return self._controller.velocity


def _read_wheels(config: YamlReader) -> tuple[GroundWheel, ...]:
    layout = read_choice(config, "layout", _LAYOUTS, "none")
    if layout == "none":
        return ()
    if layout == "mecanum":
        return mecanum_wheels(read_positive(config, "wheelbase"), read_positive(config, "track"))
    return three_wheels(
        read_positive(config, "wheel_distance"),
        config.get("wheel_angle", "angle", math.pi / 3, finite=True),
    )
