"""The velocity command, ground truth and odometry of the drive plugins."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from flatland.checks import shown
from flatland.geometry import IDENTITY, DoubleArray, Pose, Vector2, compose, invert, rotate
from flatland.plugin_api.noise import GaussianNoise
from flatland.plugin_api.occasional_warning import OccasionalWarning
from flatland.plugin_api.odometry_drift import OdometryDrift
from flatland.plugin_api.parameters import (
    planar_diagonal,
    read_covariance,
    read_phase,
    read_rate,
    read_variances,
)
from flatland.values import AckermannCommand, Odometry, Twist

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.plugin_api.plugin import ModelPlugin
    from flatland.plugin_api.ports import Command, Output
    from flatland.plugin_api.updates import UpdateFunction
    from flatland.timekeeper import Timekeeper

C = TypeVar("C", Twist, AckermannCommand)

# m/s, rad/s; beyond the speed of any robot, and small enough for the range of the physics.
MAX_COMMAND = 1e6


class CommandGuard(Generic[C]):
    """Rejects commands that are not finite, so that the previous command remains in effect."""

    def __init__(self, owner: str) -> None:
        """Creates a guard.

        Args:
            owner: Name of the drive for the log, such as `plugin "drive" of model "robot"`.
        """
        self._owner = owner
        self._warning = OccasionalWarning()

    @classmethod
    def of(cls, plugin: ModelPlugin) -> CommandGuard[C]:
        """Creates the guard of the commands of a drive."""
        return cls(f'plugin "{plugin.name}" of model "{plugin.model.name}"')

    def __call__(self, command: C) -> bool:
        """Returns whether a command is valid; otherwise logs a warning, at most one a second."""
        try:
            # A generator expression takes longer than the comparisons.
            for name in command.__slots__:
                if not abs(getattr(command, name)) <= MAX_COMMAND:
                    break
            else:
                return True
        except TypeError:
            raise TypeError(f"a command must consist of numbers, got {shown(command)}") from None
        self._warning.log(
            "%s: %s is not finite or out of range, the previous command remains in effect",
            self._owner,
            command,
        )
        return False


def open_twist_command(plugin: ModelPlugin, topic: str) -> Command[Twist]:
    """Declares the velocity command of a drive.

    Unlike the reference: a NaN or infinite command is rejected; it would corrupt the physics state.

    Args:
        plugin: The drive.
        topic: Topic under the namespace of the model, global with a leading `/`.

    Raises:
        PluginError: The topic is not a legal name.
    """
    guard: CommandGuard[Twist] = CommandGuard.of(plugin)
    return plugin.command(topic, Twist, accept=guard)


class Odometer:
    """Emits the motion of a body as ground truth and as odometry with noise.

    The odometry frame is the world frame at first. With `odom_drift`, the odometry is an estimate
    that drifts from the true pose (`OdometryDrift`).

    Attributes:
        frame_id: Frame of the odometry pose, as in the YAML file.
        world_frame_id: Frame of the ground truth, as in the YAML file.
        child_frame_id: Frame of the body.
        sends_transform: Whether `report` sends the transform from the odometry frame to the body.
        twist_noise: Noise of vx, vy and the yaw rate of a twist emitted besides the odometry.
    """

    def __init__(
        self,
        plugin: ModelPlugin,
        config: YamlReader,
        body: Body,
        *,
        twist_in_local_frame: bool,
        sends_transform: bool,
        publish: bool = True,
        center: Vector2 = (0.0, 0.0),
    ) -> None:
        """Reads the parameters and declares the outputs.

        Args:
            plugin: The drive.
            config: Parameters of the drive.
            body: Body whose origin is measured.
            twist_in_local_frame: Default of the parameter of that name.
            sends_transform: Default of the parameter `enable_odom_tf_pub`.
            publish: Whether to declare outputs; the parameters are checked in any case.
            center: Point of the body that moves along its x axis, body frame [m].

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        truth_topic = config.get("ground_truth_pub", "string", "odometry/ground_truth")
        odometry_topic = config.get("odom_pub", "string", "odometry/filtered")
        self.frame_id: str = config.get("odom_frame_id", "string", "odom")
        self.world_frame_id: str = config.get("ground_truth_frame_id", "string", "map")
        self._local: bool = config.get("twist_in_local_frame", "bool", twist_in_local_frame)
        self.sends_transform: bool = config.get("enable_odom_tf_pub", "bool", sends_transform)
        pose_variances = read_variances(config, "odom_pose_noise")
        twist_variances = read_variances(config, "odom_twist_noise")
        # A covariance of the file is emitted unchanged; the drift adds to the default covariance.
        self._adds_pose_covariance = "odom_pose_covariance" not in config
        self._adds_twist_covariance = "odom_twist_covariance" not in config
        self._pose_covariance = read_covariance(
            config, "odom_pose_covariance", planar_diagonal(pose_variances)
        )
        self._twist_covariance = read_covariance(
            config, "odom_twist_covariance", planar_diagonal(twist_variances)
        )
        self._pose_noise = GaussianNoise(plugin.noise_stream("odometry pose"), pose_variances)
        self._twist_noise = GaussianNoise(plugin.noise_stream("odometry twist"), twist_variances)
        # The twist output is a separate measurement with the same variances.
        self.twist_noise = GaussianNoise(plugin.noise_stream("twist"), twist_variances)
        all_noise = (self._pose_noise, self._twist_noise, self.twist_noise)
        self._active_noise = tuple(noise for noise in all_noise if noise)
        self._body = body
        self.child_frame_id = plugin.model.frame(body.name)
        self._plugin = plugin
        self._is_exact = True  # The odometry is the true pose, apart from white noise.
        # Pose of the world frame in the odometry frame, without drift.
        self._offset = IDENTITY
        self._drift: OdometryDrift | None = None
        drift = config.get_list(
            "odom_drift", "float", [0.0, 0.0, 0.0, 0.0], size=4, finite=True, minimum=0
        )
        if any(drift):
            a1, a2, a3, a4 = drift
            stream = plugin.noise_stream("odometry drift")
            self._is_exact = False
            self._drift = OdometryDrift((a1, a2, a3, a4), stream, body.pose, center)
        self._truth: Output[Odometry] | None = None
        self._odometry: Output[Odometry] | None = None
        if publish:
            self._truth = plugin.output(truth_topic, Odometry)
            self._odometry = plugin.output(odometry_topic, Odometry)

    def publish_at_rate(
        self, config: YamlReader, publish: UpdateFunction, outputs: Iterable[Output[Any]] = ()
    ) -> None:
        """Reads `pub_rate` and `after_step`, and declares the updates.

        Args:
            config: Parameters of the drive.
            publish: Publishes the current state.
            outputs: What it emits besides the ground truth and the odometry.

        Raises:
            YamlError: A parameter is invalid.
        """
        rate = read_rate(config, "pub_rate")
        phase = read_phase(config, rate)
        plugin = self._plugin
        if self.sends_transform:
            frames = (self.frame_id, self.child_frame_id)
            plugin.declare_transform(*frames, switch="enable_odom_tf_pub: false")
        if self._drift is not None:
            # In each step, so that the drift depends neither on the rate nor on subscribers.
            plugin.on_update(self._advance_drift, phase="after")
            plugin.on_update(publish, rate, phase=phase)
            return
        own = (output for output in (self._truth, self._odometry) if output is not None)
        plugin.on_update(
            publish,
            rate,
            phase=phase,
            outputs=(*own, *outputs),
            transforms=self.sends_transform,
            bodies=[self._body],
            skipped=self._skip,
        )

    def _advance_drift(self, timekeeper: Timekeeper) -> None:
        del timekeeper
        if self._drift is not None:
            self._drift.advance(self._body.pose)

    def _skip(self, count: int, stamp: int, poses: Sequence[Pose]) -> None:
        """Accounts for skipped updates; see `FlatlandPlugin.on_update`."""
        for noise in self._active_noise:
            noise.begin_update(count)
        if self.sends_transform:
            noisy_pose = self._noisy_estimate(poses[0])
            self._plugin.send_past_transform(stamp, self.frame_id, self.child_frame_id, *noisy_pose)

    @property
    def wanted(self) -> bool:
        """Whether the ground truth or the odometry is wanted."""
        truth, odometry = self._truth, self._odometry
        return (truth is not None and truth.wanted) or (odometry is not None and odometry.wanted)

    def begin_update(self) -> None:
        """Advances the noise; to be called for each update due, emitted or not."""
        for noise in self._active_noise:
            noise.begin_update()

    def move(self, previous: Pose, keep: bool) -> None:
        """Adapts the odometry to a move of the model by a request.

        Args:
            previous: Pose of the body before the move, in the world frame [m, rad].
            keep: Whether the odometry remains as before the move; otherwise it jumps along.
        """
        pose = self._body.pose
        if self._drift is not None:
            self._drift.move(previous, pose, keep)
        elif keep and all(map(math.isfinite, previous)):
            self._is_exact = False
            self._offset = compose(self._estimate(previous), invert(pose))

    def state(self) -> object:
        """Returns everything that changes, for `FlatlandPlugin.state`."""
        return (self._offset, None if self._drift is None else self._drift.state())

    def _estimate(self, pose: Pose) -> Pose:
        """Returns the odometry without white noise, in the odometry frame."""
        return compose(self._offset, pose) if self._drift is None else self._drift.pose

    def measure(self, pose: Pose, velocity: Pose) -> Pose:
        """Returns the velocity that the odometry measures, without white noise.

        Args:
            pose: (x, y, yaw) of the origin of the body in the world frame [m, rad].
            velocity: (vx, vy, omega) of the origin of the body in the world frame [m/s, rad/s].

        Returns:
            (vx, vy, omega) in the frame of the body [m/s, rad/s].
        """
        twist = to_local(velocity, pose[2])
        return twist if self._drift is None else self._drift.measure(twist)

    def twist_covariance(self, pose: Pose, velocity: Pose, yaw: float = 0.0) -> DoubleArray:
        """Returns the covariance of a measured velocity with white noise, shape (6, 6).

        Args:
            pose: As for `measure`.
            velocity: As for `measure`.
            yaw: Heading of the body in the frame of the result, 0 for the frame of the body [rad].
        """
        drift = self._drift
        if drift is None or not self._adds_twist_covariance:
            return self._twist_covariance
        twist = to_local(velocity, pose[2])
        covariance: DoubleArray = drift.twist_covariance(twist, yaw) + self._twist_covariance
        return covariance

    def report(self, stamp: int, pose: Pose, velocity: Pose) -> None:
        """Emits the ground truth, the odometry and the transform, each if it is wanted.

        Args:
            stamp: Simulated time [ns].
            pose: (x, y, yaw) of the origin of the body in the world frame [m, rad].
            velocity: (vx, vy, omega) of the origin of the body in the world frame [m/s, rad/s].
        """
        truth, odometry = self._truth, self._odometry
        wants_truth = truth is not None and truth.wanted
        wants_odometry = odometry is not None and odometry.wanted
        if not (self.sends_transform or wants_truth or wants_odometry):
            return
        estimate = pose if self._is_exact else self._estimate(pose)
        noisy_pose = self._noisy(estimate, self._pose_noise) if self._active_noise else estimate
        if self.sends_transform:
            self._plugin.send_transform(self.frame_id, self.child_frame_id, *noisy_pose)
        if not (wants_truth or wants_odometry):
            return
        true_twist = to_local(velocity, pose[2]) if self._local else velocity
        child = self.child_frame_id
        if truth is not None and wants_truth:
            truth.emit(Odometry(stamp, self.world_frame_id, child, pose, true_twist))
        if odometry is not None and wants_odometry:
            twist, pose_covariance = true_twist, self._pose_covariance
            yaw = 0.0 if self._local else estimate[2]
            if not self._is_exact:
                twist = self.measure(pose, velocity)
                twist = (*rotate(twist, yaw), twist[2])
            if self._drift is not None and self._adds_pose_covariance:
                pose_covariance = self._drift.pose_covariance() + pose_covariance
            if self._active_noise:
                twist = self._noisy(twist, self._twist_noise)
            odometry.emit(
                Odometry(
                    stamp,
                    self.frame_id,
                    child,
                    noisy_pose,
                    twist,
                    pose_covariance,
                    self.twist_covariance(pose, velocity, yaw),
                )
            )

    def _noisy_estimate(self, pose: Pose) -> Pose:
        return self._noisy(pose if self._is_exact else self._estimate(pose), self._pose_noise)

    @staticmethod
    def _noisy(values: Pose, noise: GaussianNoise) -> Pose:
        if not noise:
            return values
        return (
            values[0] + noise.sample(0),
            values[1] + noise.sample(1),
            values[2] + noise.sample(2),
        )


def to_local(velocity: Pose, yaw: float) -> Pose:
    """Transforms a velocity from the world frame to the frame of a body with a yaw angle."""
    return (*rotate(velocity, -yaw), velocity[2])
