from __future__ import annotations

from typing import Any

import pytest

from flatland.plugins.dummy_model_plugin import DummyModelPlugin
from flatland.plugins.dummy_world_plugin import DummyWorldPlugin

GOOD = {
    "dummy_param_float": "0.123456",
    "dummy_param_string": "dummy_test_123456",
    "dummy_param_int": "123456",
}


def dummy(values: dict[str, str], type_name: str = "DummyModelPlugin") -> str:
    entries = ", ".join(f"{key}: {value}" for key, value in values.items())
    return f"- {{type: {type_name}, name: dummy, {entries}}}"


@pytest.mark.parametrize("type_name", ["DummyModelPlugin", "flatland_plugins::DummyModelPlugin"])
def test_model_plugin_is_found_and_started(plugin_world: Any, type_name: str) -> None:
    world = plugin_world(dummy(GOOD, f"'{type_name}'"))
    world.step(2)
    assert type(world.model("robot").plugin("dummy")) is DummyModelPlugin


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("dummy_param_float", "0.123457"),
        ("dummy_param_string", "dummy_test_1234567"),
        ("dummy_param_int", "123457"),
    ],
)
def test_error_of_the_model_plugin_names_the_parameter(
    plugin_world: Any, key: str, value: str
) -> None:
    text = plugin_world.error(dummy({**GOOD, key: value}))
    assert f'Invalid "{key}", must be {GOOD[key]}, got {value}' in text
    assert f'"{key}"' in plugin_world.error(
        dummy({name: good for name, good in GOOD.items() if name != key})
    )


def test_model_plugin_rejects_other_parameters(plugin_world: Any) -> None:
    assert "more" in plugin_world.error(dummy({**GOOD, "more": "1"}))


@pytest.mark.parametrize("type_name", ["DummyWorldPlugin", "flatland_plugins::DummyWorldPlugin"])
def test_world_plugin_is_found_and_started(plugin_world: Any, type_name: str) -> None:
    world = plugin_world(world_plugins=f"- {{type: '{type_name}', name: dummy}}")
    world.step(2)
    assert [type(plugin) for plugin in world.plugins] == [DummyWorldPlugin]


def test_world_plugin_rejects_parameters(plugin_world: Any) -> None:
    text = plugin_world.error("", world_plugins="- {type: DummyWorldPlugin, name: d, more: 1}")
    assert 'World Plugin "d" type "DummyWorldPlugin": ' in text
    assert "more" in text
