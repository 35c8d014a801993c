"""A differential drive that follows velocity commands and emits odometry."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.plugin_api.drive import Odometer, open_twist_command
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.parameters import read_body
from flatland.plugin_api.plugin import ModelPlugin
from flatland.values import TwistWithCovariance

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.plugin_api.ports import Output
    from flatland.timekeeper import Timekeeper


class DiffDrive(ModelPlugin):
    """Moves the origin of a body with the commanded linear and angular velocity."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the ports.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        self.body = read_body(config, self.model)
        self.linear_dynamics = DynamicsLimits.from_config(
            config.optional_subnode("linear_dynamics", "map")
        )
        self.angular_dynamics = DynamicsLimits.from_config(
            config.optional_subnode("angular_dynamics", "map")
        )
        self._odometer = Odometer(
            self,
            config,
            self.body,
            twist_in_local_frame=True,
            sends_transform=True,
            publish=config.get("enable_odom_pub", "bool", True),
        )
        self.world_frame_id = self._odometer.world_frame_id
        self.timer = self._odometer.schedule(
            config, lambda timekeeper: self._publish(timekeeper.sim_time_ns, self.body.pose)
        )
        twist_topic = config.get("twist_pub", "string", "twist")
        self._twist: Output[TwistWithCovariance] | None = None
        if config.get("enable_twist_pub", "bool", True):
            self._twist = self.output(twist_topic, TwistWithCovariance)
        self._command = open_twist_command(self, config.get("twist_sub", "string", "cmd_vel"))
        self._velocity = 0.0
        self._yaw_rate = 0.0

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Sets the body's velocity, then reports where it is and how it moves now."""
        dt = timekeeper.step_size
        command = self._command.value
        v = self._velocity = self.linear_dynamics.limit(self._velocity, command.linear_x, dt)
        omega = self._yaw_rate = self.angular_dynamics.limit(self._yaw_rate, command.angular_z, dt)
        body = self.body
        pose = body.pose
        # Set in every step; otherwise friction and contacts would slow the robot down.
        body.set_velocity(v * math.cos(pose[2]), v * math.sin(pose[2]), omega)
        if self.timer.check_update(timekeeper):
            self._publish(timekeeper.sim_time_ns, pose)

    def model_moved(self, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Keeps the odometry, or displaces it along with the model."""
        self._odometer.move(previous[self.body.name], keep_odometry)

    def state(self) -> object:
        """Returns the commanded velocities within the limits, and the state of the odometry."""
        return (self._velocity, self._yaw_rate, self._odometer.state())

    def _publish(self, stamp: int, pose: Pose) -> None:
        twist = self._twist
        odometer = self._odometer
        odometer.begin_update()
        wants_twist = twist is not None and twist.wanted
        if not (wants_twist or odometer.sends_transform or odometer.wanted):
            return
        velocity = self.body.velocity
        odometer.report(stamp, pose, velocity)
        if twist is not None and wants_twist:
            forward, _, yaw_rate = odometer.measure(pose, velocity)
            noise = odometer.twist_noise
            twist.emit(
                TwistWithCovariance(
                    stamp,
                    odometer.child_frame_id,
                    (forward + noise.sample(0), 0.0, yaw_rate + noise.sample(2)),
                    odometer.twist_covariance(pose, velocity),
                )
            )
