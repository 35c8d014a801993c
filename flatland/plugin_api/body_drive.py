"""The common part of drives that report odometry and the velocity of their wheels."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Final

from flatland.plugin_api.drive import Odometer, open_twist_command
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.parameters import read_not_negative
from flatland.plugin_api.plugin import ModelPlugin
from flatland.timekeeper import NANOSECONDS
from flatland.values import Twist, TwistWithCovariance

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.geometry import Pose, Vector2
    from flatland.physics import DriveController
    from flatland.plugin_api.ports import Command, Output
    from flatland.plugin_api.traction import Traction
    from flatland.timekeeper import Timekeeper


_MAX_TIMEOUT: Final = 1 << 62  # ns


class BodyDrive(ModelPlugin):
    """Drives a body by a controller of the core, and emits where it is and how it moves.

    A subclass calls `read_limits`, creates the controller, which moves the body in each step, calls
    `apply_limits`, `open_reports` and `open_twist`, and passes commands to the controller in
    `set_target`.

    Attributes:
        body: The driven body.
        is_holonomic: Whether the drive moves the body sideways.
        takes_steering: Whether the angular part of a command is a steering angle [rad] instead of a
            yaw rate.
    """

    body: Body
    _traction: Traction | None = None
    _controller: DriveController
    _limits: tuple[DynamicsLimits, DynamicsLimits]  # linear, angular
    _command_timeout = 0.0
    _odometer: Odometer
    _twist: Output[TwistWithCovariance] | None
    is_holonomic = False
    takes_steering = False

    @property
    def controller(self) -> DriveController:
        """The controller of the core that moves the body."""
        return self._controller

    def read_limits(self, config: YamlReader) -> None:
        """Reads `linear_dynamics`, `angular_dynamics` and `command_timeout`; for `on_initialize`.

        Raises:
            YamlError: A limit is invalid.
        """
        linear, angular = (
            DynamicsLimits.from_config(config.optional_subnode(key, "map"))
            for key in ("linear_dynamics", "angular_dynamics")
        )
        self._limits = linear, angular
        self._command_timeout = read_not_negative(config, "command_timeout", 0.0)

    @property
    def linear_dynamics(self) -> DynamicsLimits:
        """Limits of the linear velocity of the drive; settable."""
        return self._limits[0]

    @linear_dynamics.setter
    def linear_dynamics(self, limits: DynamicsLimits) -> None:
        self._limits = limits, self._limits[1]
        self.apply_limits()

    @property
    def angular_dynamics(self) -> DynamicsLimits:
        """Limits of the yaw rate, or of the steering; settable."""
        return self._limits[1]

    @angular_dynamics.setter
    def angular_dynamics(self, limits: DynamicsLimits) -> None:
        self._limits = self._limits[0], limits
        self.apply_limits()

    @property
    def command_timeout(self) -> float:
        """Simulated time without a command after which the drive stops [s]; settable.

        The drive stops as after a command of zeros, within its limits; 0 or infinity for never.
        """
        return self._command_timeout

    @command_timeout.setter
    def command_timeout(self, timeout: float) -> None:
        if not timeout >= 0.0:
            raise ValueError(f"command_timeout must not be negative or NaN, got {timeout}")
        self._command_timeout = float(timeout)
        self._apply_timeout()

    @property
    def traction(self) -> Traction | None:
        """Limits of the forces in mode `force`, settable; None in mode `velocity`."""
        return self._traction

    @traction.setter
    def traction(self, traction: Traction | None) -> None:
        if traction is None and self._traction is not None:
            raise ValueError("a drive with limits of forces cannot return to the mode velocity")
        if traction is not None:
            traction.apply(self.body, self._controller)
        self._traction = traction

    def apply_limits(self) -> None:
        """Passes the limits and the timeout to the controller."""
        self._set_limits(*self._limits)
        if self._command_timeout:
            self._apply_timeout()

    def _apply_timeout(self) -> None:
        self._controller.set_command_timeout(_to_nanoseconds(self._command_timeout))

    @abstractmethod
    def _set_limits(self, linear: DynamicsLimits, angular: DynamicsLimits) -> None:
        """Sets the limits of the controller."""

    def open_reports(self, config: YamlReader, center: Vector2 = (0.0, 0.0)) -> None:
        """Declares the outputs and arranges for the updates; for `on_initialize`.

        Args:
            config: Parameters of the drive.
            center: Point of the body that moves along its x axis, body frame [m].

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        self._odometer = Odometer(
            self,
            config,
            self.body,
            twist_in_local_frame=True,
            sends_transform=True,
            publish=config.get("enable_odom_pub", "bool", True),
            center=center,
        )
        self.world_frame_id = self._odometer.world_frame_id
        twist_topic = config.get("twist_pub", "string", "twist")
        self._twist = None
        if config.get("enable_twist_pub", "bool", True):
            self._twist = self.output(twist_topic, TwistWithCovariance)
        outputs = () if self._twist is None else (self._twist,)
        self._odometer.publish_at_rate(config, self._publish, outputs)

    def open_twist(self, config: YamlReader) -> Command[Twist]:
        """Declares the command of a velocity; for `on_initialize`.

        Raises:
            YamlError: The topic is not a string.
            PluginError: The topic is not a legal name.
        """
        command = open_twist_command(self, config.get("twist_sub", "string", "cmd_vel"))
        command.on_change = self.command_changed
        return command

    def command_changed(self) -> None:
        """Passes the command to the controller before the next step; safe from any thread."""
        self.set_before_step(self.set_target)

    def set_target(self) -> None:
        """Passes the command to the controller."""
        raise NotImplementedError

    def model_moved(self, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Keeps the odometry, or displaces it along with the model."""
        self._odometer.move(previous[self.body.name], keep_odometry)
        if self.traction is not None:
            self._controller.release_brakes()

    def state(self) -> object:
        """Returns the state of the controller and of the odometry."""
        state = (*self.drive_state(), self._odometer.state())
        if self._command_timeout:
            state = (*state, self._controller.command_age)
        return state if self.traction is None else (*state, self._controller.traction_state)

    def drive_state(self) -> tuple[object, ...]:
        """Returns what changes in the controller, apart from the traction."""
        raise NotImplementedError

    def _publish(self, timekeeper: Timekeeper) -> None:
        twist = self._twist
        odometer = self._odometer
        odometer.begin_update()
        wants_twist = twist is not None and twist.wanted
        if not (wants_twist or odometer.sends_transform or odometer.wanted):
            return
        stamp, pose, velocity = timekeeper.sim_time_ns, self.body.pose, self.body.velocity
        odometer.report(stamp, pose, velocity)
        if twist is not None and wants_twist:
            forward, sideways, yaw_rate = odometer.measure(pose, velocity)
            noise = odometer.twist_noise
            twist.emit(
                TwistWithCovariance(
                    stamp,
                    odometer.child_frame_id,
                    (
                        forward + noise.sample(0),
                        sideways + noise.sample(1) if self.is_holonomic else 0.0,
                        yaw_rate + noise.sample(2),
                    ),
                    odometer.twist_covariance(pose, velocity),
                )
            )


def _to_nanoseconds(timeout: float) -> int:
    """Returns a timeout in nanoseconds; 0, which means none, only for 0 and infinity."""
    if timeout == 0.0 or math.isinf(timeout):
        return 0
    return min(max(round(timeout * NANOSECONDS), 1), _MAX_TIMEOUT)
