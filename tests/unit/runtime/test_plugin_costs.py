"""The wall time of plugins."""

from __future__ import annotations

from typing import Any

import pytest

import flatland
from flatland.runtime.plugin_costs import PluginCosts

MODEL = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
- {type: Gps, name: a, body: base}
- {type: Gps, name: b, body: base, topic: other}
- {type: DiffDrive, name: drive, body: base}
"""


@pytest.fixture
def robot(files: Any) -> flatland.Model:
    return files.load_model(MODEL).model("robot")


def named(name: str, kind: str) -> str:
    return f'Model Plugin "{name}" type "{kind}" model "robot"'


def test_types_are_listed_only_if_plugins_share_one(robot: flatland.Model, fake_time: Any) -> None:
    costs = PluginCosts(fake_time.clock)
    assert costs.describe(10.0, 3) == "no plugin ran"
    for name, seconds in (("a", 1.0), ("drive", 1.5)):
        costs.timed(robot.plugin(name), fake_time.spend)(seconds)
    apart = f"{named('drive', 'DiffDrive')} 15.0 %, {named('a', 'Gps')} 10.0 %"
    assert costs.describe(10.0, 3) == apart
    costs.timed(robot.plugin("b"), fake_time.spend)(1.0)
    assert costs.describe(10.0, 2) == (f"{apart}; by type: 2 x Gps 20.0 %, 1 x DiffDrive 15.0 %")


def test_what_a_hook_has_done_later_belongs_to_its_plugin(
    robot: flatland.Model, fake_time: Any
) -> None:
    costs = PluginCosts(fake_time.clock)
    actions: list[Any] = []

    def hook(seconds: float) -> None:
        fake_time.spend(seconds)
        actions.append(costs.later(fake_time.spend))

    plugin = robot.plugin("a")
    costs.timed(plugin, hook)(1.0)
    assert costs.running is None
    hook(4.0)  # of no plugin
    for action in actions:
        action(2.0)
    assert costs.seconds == {plugin: 3.0}
