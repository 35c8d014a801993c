"""A model plugin that only checks its parameters, for tests of plugin loading."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.plugin_api.parameters import at_key
from flatland.plugin_api.plugin import ModelPlugin

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader


class DummyModelPlugin(ModelPlugin):
    """Loads if its three parameters have the expected values."""

    def on_initialize(self, config: YamlReader) -> None:
        """Checks the parameters.

        Raises:
            YamlError: A parameter does not have the expected value; the text names it.
        """
        expected_float, expected_string, expected_int = 0.123456, "dummy_test_123456", 123456
        for key, value, expected in (
            ("dummy_param_float", config.get("dummy_param_float", "float"), expected_float),
            ("dummy_param_string", config.get("dummy_param_string", "string"), expected_string),
            ("dummy_param_int", config.get("dummy_param_int", "int"), expected_int),
        ):
            if value != expected:
                raise at_key(config, key).error(f'Invalid "{key}", must be {expected}, got {value}')
