"""A contact sensor: all contacts of a model with their forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flatland.plugin_api.parameters import read_bodies, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.values import Collision, Collisions

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.physics import Touch
    from flatland.timekeeper import Timekeeper

_NO_FORCES = np.zeros(0)
_NO_POINTS = np.zeros((0, 2))


class Bumper(ModelPlugin):
    """Emits the current contacts of its model (`flatland.Collisions`)."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._frame_id: str = config.get("world_frame_id", "string", "map")
        publish_all: bool = config.get("publish_all_collisions", "bool", True)
        rate = read_rate(config)
        self._touches = self.collect_touches(
            self.model.bodies, exclude=read_bodies(config, self.model, "exclude")
        )
        self._output = self.output(config.get("topic", "string", "collisions"), Collisions)
        # At the update rate, and in each step with contacts if `publish_all_collisions` is set.
        self.on_update(
            self._publish,
            rate,
            outputs=[self._output],
            touches=self._touches,
            at_touches=publish_all,
        )

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Emits all contacts."""
        if self._output.wanted:
            dt = timekeeper.step_size
            collisions = tuple(self._collision(touch, dt) for touch in self._touches.read())
            self._output.emit(Collisions(timekeeper.sim_time_ns, self._frame_id, collisions))

    def state(self) -> object:
        """Returns the bodies of all current contacts."""
        return sorted(self._names(touch) for touch in self._touches.read())

    def _names(self, touch: Touch) -> tuple[str, str, str]:
        """Returns the names of this body, the other entity and the other body."""
        this_body = self.world.body_of_id(touch.this_body)
        other_body = self.world.body_of_id(touch.other_body)
        return (this_body.name, other_body.entity.name, other_body.name)

    def _collision(self, touch: Touch, dt: float) -> Collision:
        forces, positions, normals = _NO_FORCES, _NO_POINTS, _NO_POINTS
        if touch.solver_calls:
            # The mean force at each contact point over all solver calls of the step [N].
            total = np.hypot(touch.normal_impulses, touch.tangent_impulses)
            forces = total / (touch.solver_calls * dt)
            positions = np.array(touch.points).reshape(-1, 2)
            sign = 1.0 if touch.is_a else -1.0
            normals = np.tile(sign * np.array(touch.normal), (len(touch.points), 1))
        body, other_entity, other_body = self._names(touch)
        return Collision(
            self.model.name,
            body,
            other_entity,
            other_body,
            forces,
            positions,
            normals,
        )
