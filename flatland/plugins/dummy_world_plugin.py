"""A world plugin that does nothing, to test how plugins are found."""

from __future__ import annotations

from flatland.plugin_api.plugin import WorldPlugin


class DummyWorldPlugin(WorldPlugin):
    """Takes no parameters; an entry that has any does not load."""
