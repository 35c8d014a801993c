"""DummyModelPlugin, which the reference has for tests of its own."""

from __future__ import annotations

from typing import Any


def test_loads_with_the_expected_values(plugin_world: Any) -> None:
    world = plugin_world(
        "[{type: DummyModelPlugin, name: dummy, dummy_param_float: 0.123456,"
        " dummy_param_string: dummy_test_123456, dummy_param_int: 123456}]"
    )
    assert [plugin.name for plugin in world.model("robot").plugins] == ["dummy"]
