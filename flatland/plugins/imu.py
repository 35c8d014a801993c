"""An inertial measurement unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.geometry import IDENTITY, Vector2, rotate
from flatland.plugin_api.noise import GaussianNoise
from flatland.plugin_api.parameters import (
    at_key,
    read_body,
    read_covariance,
    read_rate,
    read_variances,
)
from flatland.plugin_api.plugin import ModelPlugin
from flatland.timekeeper import NANOSECONDS
from flatland.values import Imu as ImuValue

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.plugin_api.ports import Output
    from flatland.timekeeper import Timekeeper


class Imu(ModelPlugin):
    """Emits the orientation, yaw rate and acceleration of a body (`flatland.Imu`)."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._body = read_body(config, self.model)
        # Unlike the reference: messages have the same namespaced frame id as the transform.
        self._frame_id = self.model.frame(config.get("imu_frame_id", "string", "imu"))
        self._parent_frame_id = self.model.frame(self._body.name)
        self._broadcast_tf: bool = config.get("broadcast_tf", "bool", True)
        rate = _read_update_rate(config)

        yaw_variances = read_variances(config, "orientation_noise")
        rate_variances = read_variances(config, "angular_velocity_noise")
        acceleration_variances = read_variances(config, "linear_acceleration_noise")
        self._noise = GaussianNoise(
            self.noise_stream("filtered"),
            (yaw_variances[2], rate_variances[2], *acceleration_variances[:2]),
        )
        self._covariances = (
            read_covariance(config, "orientation_covariance", yaw_variances),
            read_covariance(config, "angular_velocity_covariance", rate_variances),
            read_covariance(config, "linear_acceleration_covariance", acceleration_variances),
        )
        filtered_topic = config.get("imu_pub", "string", "imu/filtered")
        truth_topic = config.get("ground_truth_pub", "string", "imu/ground_truth")
        self._filtered: Output[ImuValue] | None = None
        self._ground_truth: Output[ImuValue] | None = None
        if config.get("enable_imu_pub", "bool", True):
            self._filtered = self.output(filtered_topic, ImuValue)
            self._ground_truth = self.output(truth_topic, ImuValue)
        # Stamp and velocity at the last update due, emitted or not, so that the first message after
        # a subscription is correct too.
        self._last: tuple[int, Pose] | None = None
        # The sensor may use the frame of its body; TF does not allow a frame to be its own parent.
        self._broadcast_tf = self._broadcast_tf and self._frame_id != self._parent_frame_id
        if self._broadcast_tf:
            frames = (self._parent_frame_id, self._frame_id)
            self.declare_transform(*frames, pose=IDENTITY, switch="broadcast_tf: false")
        self.on_update(self._publish, rate)

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Emits the measurements and sends the transform."""
        self._noise.begin_update()
        stamp, velocity = timekeeper.sim_time_ns, self._body.velocity
        truth_wanted = self._ground_truth is not None and self._ground_truth.wanted
        filtered_wanted = self._filtered is not None and self._filtered.wanted
        if truth_wanted or filtered_wanted:
            yaw = self._body.pose[2]
            truth = ImuValue(
                stamp, self._frame_id, yaw, velocity[2], self._acceleration(stamp, velocity, yaw)
            )
            if self._ground_truth is not None and truth_wanted:
                self._ground_truth.emit(truth)
            if self._filtered is not None and filtered_wanted:
                self._filtered.emit(self._with_noise(truth))
        self._last = (stamp, velocity)
        if self._broadcast_tf:
            self.send_transform(self._parent_frame_id, self._frame_id, 0.0, 0.0, 0.0)

    def state(self) -> object:
        """Returns the time and velocity of the last update due."""
        return self._last

    def _acceleration(self, stamp: int, velocity: Pose, yaw: float) -> Vector2:
        """Returns the mean acceleration since the last update due, in the body frame [m/s²]."""
        if self._last is None:
            return (0.0, 0.0)
        last_stamp, last_velocity = self._last
        # Unlike the reference: divides by the elapsed simulated time instead of multiplying by the
        # rate, which is infinite by default, and rotates both axes with the correct signs.
        dt = (stamp - last_stamp) / NANOSECONDS
        change = ((velocity[0] - last_velocity[0]) / dt, (velocity[1] - last_velocity[1]) / dt)
        return rotate(change, -yaw)

    def _with_noise(self, truth: ImuValue) -> ImuValue:
        noise = self._noise.sample
        ax, ay = truth.linear_acceleration
        return ImuValue(
            truth.stamp,
            truth.frame_id,
            truth.yaw + noise(0),
            truth.yaw_rate + noise(1),
            (ax + noise(2), ay + noise(3)),
            *self._covariances,
        )


def _read_update_rate(config: YamlReader) -> float:
    """Reads the rate [Hz] from `update_rate` or its older spelling `pub_rate`."""
    if "pub_rate" not in config:
        return read_rate(config)
    if "update_rate" in config:
        raise at_key(config, "pub_rate").error(
            'Invalid "pub_rate", the older spelling of "update_rate", must not be combined with it'
        )
    return read_rate(config, "pub_rate")
