"""A publisher of the true pose of a body."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from flatland.geometry import compose
from flatland.plugin_api.parameters import (
    at_key,
    read_body_or_first,
    read_choice,
    read_phase,
    read_pose,
    read_rate,
)
from flatland.plugin_api.plugin import ModelPlugin
from flatland.values import Odometry, PoseStamped

if TYPE_CHECKING:
    from collections.abc import Callable

    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.plugin_api.ports import Output
    from flatland.timekeeper import Timekeeper

MESSAGES: Final = ("pose", "odometry")


class PosePublisher(ModelPlugin):
    """Emits the true pose of a body, optionally with its true velocity.

    Attributes:
        body: The body.
        origin: Pose (x, y, theta) of the observed frame in the frame of the body.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: The topic is not a legal name.
        """
        self.body = read_body_or_first(config, self.model, "body")
        self.origin = read_pose(config, "origin")
        rate = read_rate(config)
        phase = read_phase(config, rate)
        self.world_frame_id = config.get("frame_id", "string", "map")
        child = config.get("child_frame_id", "string", self.body.name)
        message = read_choice(config, "message", MESSAGES, "pose")
        if message == "pose" and "child_frame_id" in config:
            raise at_key(config, "child_frame_id").error(
                'Invalid "child_frame_id", only used with "message: odometry"'
            )
        topic = config.get("topic", "string", message)
        self._child_frame_id = self.model.frame(child)
        self._measure: Callable[[int], PoseStamped | Odometry]
        self._output: Output[Any]
        if message == "pose":
            self._measure, self._output = self.pose_at, self.output(topic, PoseStamped)
        else:
            self._measure, self._output = self.odometry_at, self.output(topic, Odometry)
        self.on_update(self._publish, rate, phase=phase, outputs=[self._output])

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Emits the pose."""
        if self._output.wanted:
            self._output.emit(self._measure(timekeeper.sim_time_ns))

    def pose_at(self, stamp: int) -> PoseStamped:
        """Returns the current pose in the world frame with a stamp [ns]."""
        return PoseStamped(stamp, self.world_frame_id, compose(self.body.pose, self.origin))

    def odometry_at(self, stamp: int) -> Odometry:
        """Returns the current pose in the world frame and the velocity in the observed frame."""
        body = self.body.pose
        pose = compose(body, self.origin)
        velocity = self._velocity(body, pose)
        return Odometry(stamp, self.world_frame_id, self._child_frame_id, pose, velocity)

    def _velocity(self, body: Pose, pose: Pose) -> Pose:
        """Returns the velocity of the observed frame at `pose`, in its own axes [m/s, rad/s]."""
        vx, vy, omega = self.body.velocity
        # The velocity of a point of a rigid body: v + omega x r, with r from its origin.
        vx -= omega * (pose[1] - body[1])
        vy += omega * (pose[0] - body[0])
        c, s = math.cos(pose[2]), math.sin(pose[2])
        return (c * vx + s * vy, c * vy - s * vx, omega)
