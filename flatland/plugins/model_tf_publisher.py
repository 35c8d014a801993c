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
    from flatland.config.reader import YamlReader
    from flatland.timekeeper import Timekeeper


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
        self.call_when_due(update_after_step(self, config, self.timer), self.timer)
        self._sends_world: bool = config.get("publish_tf_world", "bool", False)
        self.world_frame_id = config.get("world_frame_id", "string", "map")
        self._reference_frame_id = self.model.frame(self.reference.name)
        self._others = [
            (body, self.model.frame(body.name))
            for body in self.model.bodies
            if body is not self.reference and body not in excluded
        ]

    @when_due
    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Sends the transforms if an update is due."""
        if not self.timer.check_update(timekeeper):
            return
        x, y, yaw = self.reference.pose
        c, s = math.cos(yaw), math.sin(yaw)
        reference_frame_id = self._reference_frame_id
        for body, frame_id in self._others:
            body_x, body_y, body_yaw = body.pose
            dx, dy = body_x - x, body_y - y
            self.send_transform(
                reference_frame_id, frame_id, c * dx + s * dy, c * dy - s * dx, body_yaw - yaw
            )
        if self._sends_world:
            self.send_transform(self.world_frame_id, reference_frame_id, x, y, yaw)
