"""A model plugin that only checks its parameters, to test how plugins are found."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.plugin_api.parameters import at_key
from flatland.plugin_api.plugin import ModelPlugin

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader


class DummyModelPlugin(ModelPlugin):
    """Loads if its three parameters have the values that it expects."""

    def on_initialize(self, config: YamlReader) -> None:
        """Checks the parameters.

        Raises:
            YamlError: One is not as expected; says which.
        """
        wanted_float, wanted_string, wanted_int = 0.123456, "dummy_test_123456", 123456
        for key, value, wanted in (
            ("dummy_param_float", config.get("dummy_param_float", "float"), wanted_float),
            ("dummy_param_string", config.get("dummy_param_string", "string"), wanted_string),
            ("dummy_param_int", config.get("dummy_param_int", "int"), wanted_int),
        ):
            if value != wanted:
                raise at_key(config, key).error(f'Invalid "{key}", must be {wanted}, got {value}')
