"""A gate that can be passed in one direction only."""

import math

from flatland import Body, Contact, ModelPlugin, MutableContact, Timekeeper, YamlReader
from flatland.plugins.parameters import read_body_or_first


class OneWayGate(ModelPlugin):
    """Lets bodies pass that come from the -x side of the gate, and blocks all others.

    The decision is made at the first contact of a body and holds until its last contact has ended,
    so that a robot with several footprints is not blocked half-way and can also reverse.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._body = read_body_or_first(config, self.model, "body")
        self._may_pass: dict[Body, bool] = {}
        self._contacts: dict[Body, set[int]] = {}

    def pre_solve(self, contact: MutableContact, old_manifold: object) -> None:
        """Disables contacts with bodies that may pass; called within the physics step."""
        other = self._other(contact)
        if other is None:
            return
        if other not in self._may_pass:
            self._may_pass[other] = self._is_on_near_side(other)
        if self._may_pass[other]:
            contact.enabled = False

    def begin_contact(self, contact: Contact) -> None:
        """Records a contact; contacts of sensors have no effect and are ignored."""
        other = self._other(contact)
        if other is not None and not contact.is_sensor:
            self._contacts.setdefault(other, set()).add(contact.contact_id)

    def end_contact(self, contact: Contact) -> None:
        """Removes a contact."""
        other = self._other(contact)
        if other in self._contacts:
            self._contacts[other].discard(contact.contact_id)

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Forgets bodies without contacts, after all contact events of the step."""
        for body in [body for body, ids in self._contacts.items() if not ids]:
            del self._contacts[body]
            self._may_pass.pop(body, None)

    def _other(self, contact: Contact | MutableContact) -> Body | None:
        """Returns the body that touches the gate; None for contacts of other bodies."""
        mine = self.filter_contact(contact)
        return mine.other_body if mine is not None and mine.this_body is self._body else None

    def _is_on_near_side(self, other: Body) -> bool:
        x, y = other.physics.world_center
        gate_x, gate_y, gate_yaw = self._body.pose
        return (x - gate_x) * math.cos(gate_yaw) + (y - gate_y) * math.sin(gate_yaw) < 0
