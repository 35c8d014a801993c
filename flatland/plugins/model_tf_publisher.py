"""A publisher of the transforms between the bodies of a model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.plugin_api.after_step import update_after_step
from flatland.plugin_api.parameters import read_bodies, read_body_or_first, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.schedule import when_due
from flatland.plugin_api.update_timer import UpdateTimer

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.timekeeper import Timekeeper

    FrameTransform = tuple[str, str, float, float, float]


class ModelTfPublisher(ModelPlugin):
    """Sends the poses of the bodies relative to a reference body, and its pose in the world."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters.

        Raises:
            YamlError: A parameter is invalid.
        """
        self.reference = read_body_or_first(config, self.model, "reference")
        excluded = read_bodies(config, self.model, "exclude")
        self.timer = UpdateTimer(read_rate(config))
        hook = update_after_step(self, config, self.timer)
        self._sends_world: bool = config.get("publish_tf_world", "bool", False)
        self.world_frame_id = config.get("world_frame_id", "string", "map")
        self._reference_frame_id = self.model.frame(self.reference.name)
        self._others = [
            (body, self.model.frame(body.name))
            for body in self.model.bodies
            if body is not self.reference and body not in excluded
        ]
        self.call_when_due(
            hook,
            self.timer,
            outputs=(),
            transforms=True,
            bodies=[self.reference, *(body for body, _ in self._others)],
            skipped=self._skip,
        )

    @when_due
    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Sends the transforms if an update is due."""
        if not self.timer.check_update(timekeeper):
            return
        poses = [body.pose for body, _ in self._others]
        for transform in self._transforms(self.reference.pose, poses):
            self.send_transform(*transform)

    def _skip(self, count: int, stamp: int, poses: tuple[Pose, ...]) -> None:
        """Takes over skipped updates; see `FlatlandPlugin.call_when_due`."""
        del count
        for transform in self._transforms(poses[0], poses[1:]):
            self.send_past_transform(stamp, *transform)

    def _transforms(self, reference: Pose, others: Sequence[Pose]) -> Iterator[FrameTransform]:
        """Returns all transforms: parent, child, and the pose of the child in the parent."""
        x, y, yaw = reference
        c, s = math.cos(yaw), math.sin(yaw)
        parent = self._reference_frame_id
        for (_, frame_id), (body_x, body_y, body_yaw) in zip(self._others, others, strict=True):
            dx, dy = body_x - x, body_y - y
            yield parent, frame_id, c * dx + s * dy, c * dy - s * dx, body_yaw - yaw
        if self._sends_world:
            yield self.world_frame_id, parent, x, y, yaw
