"""The velocity command, ground truth and odometry of the drive plugins."""

from __future__ import annotations

import logging
import math
import time
from typing import TYPE_CHECKING

from flatland.geometry import Pose, rotate
from flatland.plugin_api.noise import GaussianNoise
from flatland.plugin_api.parameters import planar_diagonal, read_covariance, read_variances
from flatland.values import Odometry, Twist

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.plugin_api.plugin import ModelPlugin
    from flatland.plugin_api.ports import Command, Output

_LOG = logging.getLogger("flatland")

WARNING_PERIOD = 1.0  # s of wall time between two warnings of one drive, at least
# m/s, rad/s; beyond the speed of any robot, and small enough for the range of the physics.
MAX_COMMAND = 1e6


class TwistGuard:
    """Rejects commands that are not finite, so that the previous command remains in effect."""

    def __init__(self, owner: str) -> None:
        """Creates a guard.

        Args:
            owner: Name of the drive for the log, such as `plugin "drive" of model "robot"`.
        """
        self._owner = owner
        self._last_warning = -math.inf

    def __call__(self, twist: Twist) -> bool:
        """Returns whether a command is valid; otherwise logs a warning, at most one a second."""
        if (
            abs(twist.linear_x) <= MAX_COMMAND
            and abs(twist.linear_y) <= MAX_COMMAND
            and abs(twist.angular_z) <= MAX_COMMAND
        ):
            return True
        now = time.monotonic()
        if now - self._last_warning >= WARNING_PERIOD:
            self._last_warning = now
            _LOG.warning(
                "%s: %s is not finite or out of range, the previous command remains in effect",
                self._owner,
                twist,
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
    guard = TwistGuard(f'plugin "{plugin.name}" of model "{plugin.model.name}"')
    return plugin.command(topic, Twist, accept=guard)


class Odometer:
    """Emits the motion of a body as ground truth and as odometry with noise.

    Attributes:
        frame_id: Frame of the odometry pose, as in the YAML file.
        child_frame_id: Frame of the body.
        twist_covariance: Covariance emitted with the twist, shape (6, 6).
        twist_noise: Noise of vx, vy and the yaw rate of a twist emitted besides the odometry.
    """

    def __init__(
        self,
        plugin: ModelPlugin,
        config: YamlReader,
        body: Body,
        *,
        twist_in_local_frame: bool,
        publish: bool = True,
    ) -> None:
        """Reads the parameters and declares the outputs.

        Args:
            plugin: The drive.
            config: Parameters of the drive.
            body: Body whose origin is measured.
            twist_in_local_frame: Default of the parameter of that name.
            publish: Whether to declare outputs; the parameters are checked in any case.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: A topic is not a legal name.
        """
        truth_topic = config.get("ground_truth_pub", "string", "odometry/ground_truth")
        odometry_topic = config.get("odom_pub", "string", "odometry/filtered")
        self.frame_id: str = config.get("odom_frame_id", "string", "odom")
        self._truth_frame_id: str = config.get("ground_truth_frame_id", "string", "map")
        self._local: bool = config.get("twist_in_local_frame", "bool", twist_in_local_frame)
        pose_variances = read_variances(config, "odom_pose_noise")
        twist_variances = read_variances(config, "odom_twist_noise")
        self._pose_covariance = read_covariance(
            config, "odom_pose_covariance", planar_diagonal(pose_variances)
        )
        self.twist_covariance = read_covariance(
            config, "odom_twist_covariance", planar_diagonal(twist_variances)
        )
        self._pose_noise = GaussianNoise(plugin.noise_stream("odometry pose"), pose_variances)
        self._twist_noise = GaussianNoise(plugin.noise_stream("odometry twist"), twist_variances)
        # The twist output is a separate measurement with the same variances.
        self.twist_noise = GaussianNoise(plugin.noise_stream("twist"), twist_variances)
        all_noise = (self._pose_noise, self._twist_noise, self.twist_noise)
        self._active_noise = tuple(noise for noise in all_noise if noise)
        self.child_frame_id = plugin.model.frame(body.name)
        self._truth: Output[Odometry] | None = None
        self._odometry: Output[Odometry] | None = None
        if publish:
            self._truth = plugin.output(truth_topic, Odometry)
            self._odometry = plugin.output(odometry_topic, Odometry)

    @property
    def wanted(self) -> bool:
        """Whether the ground truth or the odometry is wanted."""
        truth, odometry = self._truth, self._odometry
        return (truth is not None and truth.wanted) or (odometry is not None and odometry.wanted)

    def begin_update(self) -> None:
        """Advances the noise; to be called for each update due, emitted or not."""
        for noise in self._active_noise:
            noise.begin_update()

    def report(self, stamp: int, pose: Pose, velocity: Pose) -> Pose:
        """Emits the ground truth and the odometry, each if it is wanted.

        Args:
            stamp: Simulated time [ns].
            pose: (x, y, yaw) of the origin of the body in the world frame [m, rad].
            velocity: (vx, vy, omega) of the origin of the body in the world frame [m/s, rad/s].

        Returns:
            The pose with the noise of the odometry.
        """
        noisy_pose = self._noisy(pose, self._pose_noise)
        truth, odometry = self._truth, self._odometry
        if truth is None or odometry is None or not (truth.wanted or odometry.wanted):
            return noisy_pose
        twist = to_local(velocity, pose[2]) if self._local else velocity
        child = self.child_frame_id
        if truth.wanted:
            truth.emit(Odometry(stamp, self._truth_frame_id, child, pose, twist))
        if odometry.wanted:
            odometry.emit(
                Odometry(
                    stamp,
                    self.frame_id,
                    child,
                    noisy_pose,
                    self._noisy(twist, self._twist_noise),
                    self._pose_covariance,
                    self.twist_covariance,
                )
            )
        return noisy_pose

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
