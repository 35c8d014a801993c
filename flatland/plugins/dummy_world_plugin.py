"""A world plugin that does nothing, for tests of plugin loading."""

from __future__ import annotations

from flatland.plugin_api.plugin import WorldPlugin


class DummyWorldPlugin(WorldPlugin):
    """A world plugin without parameters; an entry with parameters is invalid."""
