"""DummyModelPlugin, which the reference has for tests of its own."""

from __future__ import annotations

from typing import Any

import pytest

VALUES = {
    "dummy_param_float": "0.123456",
    "dummy_param_string": "dummy_test_123456",
    "dummy_param_int": "123456",
}


def entry(**values: str) -> str:
    parameters = ", ".join(f"{key}: {value}" for key, value in {**VALUES, **values}.items())
    return f"[{{type: DummyModelPlugin, name: dummy, {parameters}}}]"


def test_loads_with_the_expected_values(plugin_world: Any) -> None:
    world = plugin_world(entry())
    assert [plugin.name for plugin in world.model("robot").plugins] == ["dummy"]


@pytest.mark.parametrize(
    ("key", "value"),
    [("dummy_param_float", "0.5"), ("dummy_param_string", "x"), ("dummy_param_int", "7")],
)
def test_another_value_is_an_error(plugin_world: Any, key: str, value: str) -> None:
    error = plugin_world.error(entry(**{key: value}))
    assert f'Invalid "{key}", must be {VALUES[key]}, got {value}' in error
