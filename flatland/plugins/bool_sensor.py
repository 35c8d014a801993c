"""A contact switch."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.plugin_api.parameters import read_body_or_first, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.update_timer import UpdateTimer

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.contact import Contact
    from flatland.timekeeper import Timekeeper


class BoolSensor(ModelPlugin):
    """Emits whether a body is in contact with anything (`bool`)."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._body = read_body_or_first(config, self.model, "body")
        self._timer = UpdateTimer(read_rate(config))
        self._output = self.output(config.get("topic", "string", "bool_sensor"), bool)
        self._touching: set[int] = set()
        self._touched_since_last = False

    # Unlike the reference: contacts of other bodies of the model are ignored.
    def begin_contact(self, contact: Contact) -> None:
        """Records a contact of the body."""
        if contact.body_a is self._body or contact.body_b is self._body:
            self._touching.add(contact.contact_id)
            self._touched_since_last = True

    def end_contact(self, contact: Contact) -> None:
        """Removes a contact."""
        self._touching.discard(contact.contact_id)

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Emits the state if an update is due."""
        if not self._timer.check_update(timekeeper):
            return
        if self._output.wanted:
            self._output.emit(bool(self._touching) or self._touched_since_last)
        # Reset without subscribers too, so that the first one does not receive an old contact.
        self._touched_since_last = False

    def state(self) -> object:
        """Returns the number of contacts, and whether one began since the last update due."""
        return (len(self._touching), self._touched_since_last)
