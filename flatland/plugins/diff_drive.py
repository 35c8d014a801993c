"""A differential drive that follows velocity commands and emits odometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.plugin_api.drive import Odometer, open_twist_command
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.parameters import read_body
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.schedule import when_due
from flatland.plugin_api.traction import read_traction
from flatland.values import TwistWithCovariance

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.plugin_api.ports import Output
    from flatland.timekeeper import Timekeeper


class DiffDrive(ModelPlugin):
    """Moves the origin of a body with the commanded linear and angular velocity.

    The core sets the velocity in each step (`flatland.physics.VelocityController`).

    Attributes:
        linear_dynamics: Limits of the linear velocity; settable, not to be modified.
        angular_dynamics: Limits of the angular velocity; settable, not to be modified.
        traction: Limits of the forces in mode `force`; None in mode `velocity`.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the ports.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        self.body = read_body(config, self.model)
        self._limits = tuple(
            DynamicsLimits.from_config(config.optional_subnode(key, "map"))
            for key in ("linear_dynamics", "angular_dynamics")
        )
        self._controller = self.control(self.body.control_velocity(holonomic=False))
        self._set_limits()
        self.traction = read_traction(config, self.body, self._controller, needs_torque=True)
        self._odometer = Odometer(
            self,
            config,
            self.body,
            twist_in_local_frame=True,
            sends_transform=True,
            publish=config.get("enable_odom_pub", "bool", True),
        )
        self.world_frame_id = self._odometer.world_frame_id
        twist_topic = config.get("twist_pub", "string", "twist")
        self._twist: Output[TwistWithCovariance] | None = None
        if config.get("enable_twist_pub", "bool", True):
            self._twist = self.output(twist_topic, TwistWithCovariance)
        outputs = () if self._twist is None else (self._twist,)
        self.timer = self._odometer.schedule(config, self._publish_now, outputs)
        self._command = open_twist_command(self, config.get("twist_sub", "string", "cmd_vel"))
        self._command.on_change = self._command_changed

    @property
    def linear_dynamics(self) -> DynamicsLimits:
        """Limits of the linear velocity; settable, not to be modified."""
        return self._limits[0]

    @linear_dynamics.setter
    def linear_dynamics(self, limits: DynamicsLimits) -> None:
        self._limits = (limits, self._limits[1])
        self._set_limits()

    @property
    def angular_dynamics(self) -> DynamicsLimits:
        """Limits of the angular velocity; settable, not to be modified."""
        return self._limits[1]

    @angular_dynamics.setter
    def angular_dynamics(self, limits: DynamicsLimits) -> None:
        self._limits = (self._limits[0], limits)
        self._set_limits()

    def _set_limits(self) -> None:
        linear, angular = self._limits
        self._controller.set_limits(linear.as_tuple(), angular.as_tuple())

    def _command_changed(self) -> None:
        self.set_before_step(self._set_target)

    def _set_target(self) -> None:
        command = self._command.value
        self._controller.set_target(command.linear_x, 0.0, command.angular_z)

    @when_due
    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Sets the body's velocity, then reports where it is and how it moves now."""
        self._set_target()
        # In every step; otherwise friction and contacts would slow the robot down.
        self._controller.advance(timekeeper.step_size)
        if self.timer.check_update(timekeeper):
            self._publish(timekeeper.sim_time_ns, self.body.pose)

    def model_moved(self, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Keeps the odometry, or displaces it along with the model."""
        self._odometer.move(previous[self.body.name], keep_odometry)

    def state(self) -> object:
        """Returns the commanded velocities within the limits, and the state of the odometry."""
        velocity, _, yaw_rate = self._controller.velocity
        state = (velocity, yaw_rate, self._odometer.state())
        return state if self.traction is None else (*state, self._controller.traction_state)

    def _publish_now(self, timekeeper: Timekeeper) -> None:
        self._publish(timekeeper.sim_time_ns, self.body.pose)

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
