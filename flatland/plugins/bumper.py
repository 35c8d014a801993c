"""A contact sensor: all contacts of a model with their forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flatland.geometry import DoubleArray
from flatland.plugin_api.parameters import read_bodies, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.values import Collision, Collisions

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.contact import Contact, ContactImpulse
    from flatland.timekeeper import Timekeeper

_NO_FORCES = np.zeros(0)
_NO_POINTS = np.zeros((0, 2))


@dataclass(frozen=True, slots=True)
class _Touch:
    """The bodies of a current contact, and the sign that turns its normal away from the model."""

    body: str
    other_entity: str
    other_body: str
    sign: float


class Bumper(ModelPlugin):
    """Emits the current contacts of its model (`flatland.Collisions`)."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._frame_id: str = config.get("world_frame_id", "string", "map")
        self._publish_all: bool = config.get("publish_all_collisions", "bool", True)
        self._timer = UpdateTimer(read_rate(config))
        self._excluded = set(read_bodies(config, self.model, "exclude"))
        self._output = self.output(config.get("topic", "string", "collisions"), Collisions)
        # Maintained without subscribers too: the first message must contain existing contacts.
        self._touches: dict[int, _Touch] = {}
        # Contact and impulse of each solver call of the current step, by contact id.
        self._solved: dict[int, list[tuple[Contact, ContactImpulse]]] = {}

    def begin_contact(self, contact: Contact) -> None:
        """Adds a record of the contact, unless one of its bodies is excluded."""
        mine = self.filter_contact(contact)
        # Both bodies are checked, as a contact may be between two bodies of this model.
        if mine is None or not self._excluded.isdisjoint((mine.this_body, mine.other_body)):
            return
        self._touches[contact.contact_id] = _Touch(
            mine.this_body.name,
            mine.other_entity.name,
            mine.other_body.name,
            1.0 if mine.is_a else -1.0,
        )

    def end_contact(self, contact: Contact) -> None:
        """Removes the record of the contact."""
        self._touches.pop(contact.contact_id, None)

    def post_solve(self, contact: Contact, impulse: ContactImpulse) -> None:
        """Stores the impulse of a recorded contact."""
        if contact.contact_id in self._touches:
            self._solved.setdefault(contact.contact_id, []).append((contact, impulse))

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Emits all records at the update rate, or always if `publish_all_collisions` is set."""
        every_step = self._publish_all and bool(self._touches)
        if self._output.wanted and (every_step or self._timer.check_update(timekeeper)):
            self._output.emit(
                Collisions(
                    timekeeper.sim_time_ns,
                    self._frame_id,
                    tuple(
                        self._collision(contact_id, touch, timekeeper.step_size)
                        for contact_id, touch in self._touches.items()
                    ),
                )
            )
        self._solved.clear()

    def state(self) -> object:
        """Returns the bodies of all current contacts."""
        touches = self._touches.values()
        return sorted((touch.body, touch.other_entity, touch.other_body) for touch in touches)

    def _collision(self, contact_id: int, touch: _Touch, dt: float) -> Collision:
        forces, positions, normals = _NO_FORCES, _NO_POINTS, _NO_POINTS
        calls = self._solved.get(contact_id)
        if calls:
            last = calls[-1][0]
            forces = _mean_forces([impulse for _, impulse in calls], len(last.points), dt)
            positions = last.points
            normals = np.tile(touch.sign * last.normal, (len(last.points), 1))
        return Collision(
            self.model.name,
            touch.body,
            touch.other_entity,
            touch.other_body,
            forces,
            positions,
            normals,
        )


def _mean_forces(impulses: list[ContactImpulse], n_points: int, dt: float) -> DoubleArray:
    """Returns the mean force at each contact point over all solver calls of a step [N].

    The number of points may differ between calls; a call contributes nothing to points that it
    did not have.
    """
    total = np.zeros((2, n_points))
    for impulse in impulses:
        n = min(n_points, len(impulse.normal_impulses))
        total[0, :n] += impulse.normal_impulses[:n]
        total[1, :n] += impulse.tangent_impulses[:n]
    forces: DoubleArray = np.hypot(total[0], total[1]) / (len(impulses) * dt)
    return forces
