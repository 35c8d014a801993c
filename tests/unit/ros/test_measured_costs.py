"""The measurements of /diagnostics, which must not interfere with those of the loop."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("diagnostic_msgs", reason="ROS is not installed")

from flatland.ros.diagnostics import _Costs
from flatland.runtime.plugin_costs import PluginCosts

WORLD = "{properties: {}, layers: [{name: 2d}], models: [{name: r, model: robot.model.yaml}]}"
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base}]
"""
DRIVE = 'Model Plugin "drive" type "DiffDrive" model "r" [%]'


@pytest.fixture
def world(files: Any) -> Any:
    files.write("robot.model.yaml", ROBOT)
    return files.load(WORLD)


def keys(costs: _Costs) -> list[str]:
    return [value.key for value in costs.status().values]


def test_costs_of_the_measured_time_are_reported(world: Any) -> None:
    costs = _Costs(world)
    assert costs.status().message == "no data"
    costs.begin(0.0)
    world.step()
    costs.end(0.2)
    world.step()
    assert keys(costs) == [DRIVE, "all of type DiffDrive [%]"]
    assert world.plugin_host.costs is None


def test_a_measurement_of_the_loop_is_not_replaced(world: Any) -> None:
    costs, of_loop = _Costs(world), PluginCosts()
    world.plugin_host.measure(of_loop)
    costs.begin(0.0)
    world.step()
    costs.end(0.2)
    assert world.plugin_host.costs is of_loop
    assert of_loop.seconds
    assert keys(costs) == []


def test_a_measurement_replaced_by_the_loop_is_discarded(world: Any) -> None:
    costs, of_loop = _Costs(world), PluginCosts()
    costs.begin(0.0)
    world.plugin_host.measure(of_loop)
    world.step()
    costs.end(0.2)
    assert world.plugin_host.costs is of_loop
    assert keys(costs) == []


def test_nothing_is_measured_while_paused(world: Any) -> None:
    costs = _Costs(world)
    world.pause()
    costs.begin(0.0)
    assert world.plugin_host.costs is None


def test_a_reset_ends_the_measurement(world: Any) -> None:
    costs = _Costs(world)
    costs.begin(0.0)
    world.step()
    costs.reset()
    assert world.plugin_host.costs is None
    assert keys(costs) == []
