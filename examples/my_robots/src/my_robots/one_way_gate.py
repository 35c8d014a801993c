"""A gate that lets through what comes from behind."""

import math

from flatland import Body, Contact, ModelPlugin, MutableContact, Timekeeper, YamlReader
from flatland.plugins.parameters import read_body_or_first


class OneWayGate(ModelPlugin):
    """Lets through what comes from behind (the -x side of its body), blocks all else.

    What it decides about a body at the first contact holds until the last contact has ended: a
    robot of several footprints is not caught half-way, and may also back out again.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._body = read_body_or_first(config, self.model, "body")
        self._may_pass: dict[Body, bool] = {}
        self._contacts: dict[Body, set[int]] = {}

    def pre_solve(self, contact: MutableContact, old_manifold: object) -> None:
        """Takes the force out of a contact; runs inside the physics step."""
        other = self._other(contact)
        if other is None:
            return
        if other not in self._may_pass:
            self._may_pass[other] = self._is_behind(other)
        if self._may_pass[other]:
            contact.enabled = False

    def begin_contact(self, contact: Contact) -> None:
        """Counts a contact; a sensor stops nobody, and does not count."""
        other = self._other(contact)
        if other is not None and not contact.is_sensor:
            self._contacts.setdefault(other, set()).add(contact.contact_id)

    def end_contact(self, contact: Contact) -> None:
        """Counts a contact no more."""
        other = self._other(contact)
        if other in self._contacts:
            self._contacts[other].discard(contact.contact_id)

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Forgets who is gone; only now, as one contact may end and another begin in a step."""
        for body in [body for body, ids in self._contacts.items() if not ids]:
            del self._contacts[body]
            self._may_pass.pop(body, None)

    def _other(self, contact: Contact | MutableContact) -> Body | None:
        """Returns the body that touches the gate, None when the contact is not the gate's."""
        mine = self.filter_contact(contact)
        return mine.other_body if mine is not None and mine.this_body is self._body else None

    def _is_behind(self, other: Body) -> bool:
        x, y = other.physics.world_center
        gate_x, gate_y, gate_yaw = self._body.pose
        return (x - gate_x) * math.cos(gate_yaw) + (y - gate_y) * math.sin(gate_yaw) < 0
