"""A contact switch."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.plugin_api.after_step import AFTER
from flatland.plugin_api.parameters import read_body_or_first, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.schedule import when_due
from flatland.plugin_api.update_timer import UpdateTimer

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.timekeeper import Timekeeper


class BoolSensor(ModelPlugin):
    """Emits whether a body is in contact with anything (`bool`)."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._body = read_body_or_first(config, self.model, "body")
        self._timer = UpdateTimer(read_rate(config))
        self._output = self.output(config.get("topic", "string", "bool_sensor"), bool)
        # Unlike the reference: contacts of other bodies of the model are ignored.
        self._touches = self.collect_touches([self._body])
        # Cleared without subscribers too, so that the first one does not receive an old contact.
        self.call_when_due(AFTER, self._timer, outputs=[self._output], touches=self._touches)

    @when_due
    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Emits the state if an update is due."""
        if not self._timer.check_update(timekeeper):
            return
        if self._output.wanted:
            self._output.emit(self._touches.touched)
        self._touches.clear()

    def state(self) -> object:
        """Returns the number of contacts, and whether one began since the last update due."""
        return (len(self._touches), self._touches.began)
