"""A publisher of the transforms between the bodies of a model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.plugin_api.parameters import read_bodies, read_body_or_first, read_phase, read_rate
from flatland.plugin_api.plugin import ModelPlugin

if TYPE_CHECKING:
    from collections.abc import Sequence

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
        rate = read_rate(config)
        phase = read_phase(config, rate)
        self._sends_world: bool = config.get("publish_tf_world", "bool", False)
        self.world_frame_id = config.get("world_frame_id", "string", "map")
        self._reference_frame_id = self.model.frame(self.reference.name)
        self._others = [
            (body, self.model.frame(body.name))
            for body in self.model.bodies
            if body is not self.reference and body not in excluded
        ]
        for body, frame_id in self._others:
            switch = f"exclude: [{body.name}]"
            self.declare_transform(self._reference_frame_id, frame_id, switch=switch)
        if self._sends_world:
            frames = (self.world_frame_id, self._reference_frame_id)
            self.declare_transform(*frames, switch="publish_tf_world: false")
        self.on_update(
            self._publish,
            rate,
            phase=phase,
            outputs=(),
            transforms=True,
            bodies=[self.reference, *(body for body, _ in self._others)],
            skipped=self._skip,
        )

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Sends the transforms."""
        del timekeeper
        poses = [body.pose for body, _ in self._others]
        for transform in self._transforms(self.reference.pose, poses):
            self.send_transform(*transform)

    def _skip(self, count: int, stamp: int, poses: Sequence[Pose]) -> None:
        """Accounts for skipped updates; see `FlatlandPlugin.on_update`."""
        del count
        for transform in self._transforms(poses[0], poses[1:]):
            self.send_past_transform(stamp, *transform)

    def _transforms(self, reference: Pose, others: Sequence[Pose]) -> list[FrameTransform]:
        """Returns all transforms: parent, child, and the pose of the child in the parent."""
        x, y, yaw = reference
        c, s = math.cos(yaw), math.sin(yaw)
        parent = self._reference_frame_id
        transforms: list[FrameTransform] = []
        for (_, frame_id), (body_x, body_y, body_yaw) in zip(self._others, others, strict=True):
            dx, dy = body_x - x, body_y - y
            pose = (c * dx + s * dy, c * dy - s * dx, body_yaw - yaw)
            transforms.append((parent, frame_id, *pose))
        if self._sends_world:
            transforms.append((self.world_frame_id, parent, x, y, yaw))
        return transforms
