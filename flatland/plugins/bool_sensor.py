"""A contact switch."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.plugin_api.parameters import read_body_or_first, read_rate
from flatland.plugin_api.plugin import ModelPlugin

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.timekeeper import Timekeeper


class BoolSensor(ModelPlugin):
    """Emits whether a body is in contact with anything (`bool`)."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._body = read_body_or_first(config, self.model, "body")
        rate = read_rate(config)
        self._output = self.output(config.get("topic", "string", "bool_sensor"), bool)
        # Unlike the reference: contacts of other bodies of the model are ignored.
        self._touches = self.collect_touches([self._body])
        # Cleared without subscribers too, so that the first one does not receive an old contact.
        self.on_update(self._publish, rate, outputs=[self._output], touches=self._touches)

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Emits the state."""
        del timekeeper
        if self._output.wanted:
            self._output.emit(self._touches.touched)
        self._touches.clear()

    def state(self) -> object:
        """Returns the number of contacts, and whether one began since the last update due."""
        return (len(self._touches), self._touches.began)
