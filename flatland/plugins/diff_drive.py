"""A differential drive that follows velocity commands and emits odometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.plugin_api.body_drive import BodyDrive
from flatland.plugin_api.parameters import read_body
from flatland.plugin_api.traction import read_traction

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.physics import VelocityController
    from flatland.plugin_api.dynamics_limits import DynamicsLimits


class DiffDrive(BodyDrive):
    """Moves the origin of a body with the commanded linear and angular velocity.

    The core sets the velocity in each step (`flatland.physics.VelocityController`).
    """

    _controller: VelocityController

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the ports.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        self.body = read_body(config, self.model)
        self.read_limits(config)
        self._controller = self.control(self.body.control_velocity(holonomic=False))
        self.apply_limits()
        self.traction = read_traction(config, self.body, needs_torque=True)
        self.open_reports(config)
        self._command = self.open_twist(config)

    def _set_limits(self, linear: DynamicsLimits, angular: DynamicsLimits) -> None:
        self._controller.set_limits(linear.as_tuple(), angular.as_tuple())

    def set_target(self) -> None:
        """Passes the command to the controller."""
        command = self._command.value
        self._controller.set_target(command.linear_x, 0.0, command.angular_z)

    def drive_state(self) -> tuple[object, ...]:
        """Returns the commanded velocities within the limits."""
        velocity, _, yaw_rate = self._controller.velocity
        return (velocity, yaw_rate)
