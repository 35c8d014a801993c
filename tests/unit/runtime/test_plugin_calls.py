"""Methods of plugins that programs call between two steps."""

from __future__ import annotations

from typing import Any

import pytest

import flatland

MODEL = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
- {type: Hitch, name: first, body: base}
- {type: Hitch, name: second, body: base, topic: hitch2, state_topic: hitched2, service: other}
"""


@pytest.fixture
def world(files: Any) -> flatland.World:
    world: flatland.World = files.load_model(MODEL)
    other = "\nbodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
    world.spawn_model(other, "other", pose=(0.2, 0.0, 0.0))
    return world


@pytest.mark.parametrize("by_name", [True, False])
def test_a_plugin_is_given_with_its_model_or_by_name(world: flatland.World, by_name: bool) -> None:
    first, second = world.model("robot").plugins
    plugin, model = ("second", "robot") if by_name else (second, "")
    world.call_plugin(plugin, "connect", {"name": "other"}, model)
    assert second.hitched is world.model("other")
    assert first.hitched is None


@pytest.mark.parametrize(
    ("plugin", "method", "model", "message"),
    [
        ("third", "release", "robot", 'plugin "third" of model "robot" with the method release'),
        ("first", "attach", "robot", 'plugin "first" of model "robot" with the method attach'),
        ("first", "release", "ghost", 'plugin "first" of model "ghost" with the method release'),
        ("first", "release", "", 'world plugin "first" with the method release'),
    ],
)
def test_unknown_plugins_and_methods_are_errors(
    world: flatland.World, plugin: str, method: str, model: str, message: str
) -> None:
    with pytest.raises(flatland.WorldError, match=f": {message} does not exist$"):
        world.call_plugin(plugin, method, {}, model)
