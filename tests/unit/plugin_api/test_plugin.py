"""Attributes of plugins, and the end of their ports and transforms."""

from __future__ import annotations

from typing import Any

import pytest

import flatland
from flatland import ModelPlugin, PluginError, Twist, WorldPlugin


class Model(ModelPlugin):
    def on_initialize(self, config: Any) -> None:
        self.keys = config.keys()
        self.at_start = (self.name, self.type, self.namespace, self.model.name, self.ros)
        self.out = self.output("out", float)
        self.loud = self.output("/loud", float)
        self.go = self.command("go", Twist, Twist(linear_x=1.0), lambda twist: twist.linear_x >= 0)
        config.get("gain", "float", 0.0)

    def before_physics_step(self, timekeeper: Any) -> None:
        self.out.emit(timekeeper.sim_time)
        self.send_transform("a", "b", 1.0, 2.0, 0.5)

    def on_shutdown(self) -> None:
        self.out_at_the_end = self.out.closed


class World(WorldPlugin):
    def on_initialize(self, config: Any) -> None:
        self.at_start = (self.name, self.type, self.namespace, self.ros)
        self.layers = len(self.world_config.subnode("layers", "list"))
        self.models = [model.name for model in self.world.models]


@pytest.fixture
def load(files: Any, declare_plugins: Any) -> Any:
    declare_plugins(Model, World)
    files.write(
        "own.yaml",
        """
        bodies: [{name: base, footprints: []}]
        plugins:
          - {name: one, type: "test::Model", enabled: true, gain: 2}
          - {name: two, type: "test::Model"}
          - {name: off, type: "test::Model", enabled: false}
        """,
    )

    def load_world(**options: Any) -> flatland.World:
        world: flatland.World = files.load(
            """
            properties: {}
            layers: [{name: 2d}, {name: 3d}]
            models: [{name: m, model: own.yaml, namespace: r1}]
            plugins: [{name: w, type: "test::World"}]
            """,
            **options,
        )
        return world

    return load_world


def test_attributes_are_set_before_on_initialize(load: Any) -> None:
    world = load()
    one, two = world.model("m").plugins
    assert one.at_start == ("one", "test::Model", "r1", "m", None)
    assert two.name == "two"
    # The entry without name, type and enabled.
    assert one.keys == ["gain"]
    [plugin] = world.plugins
    assert plugin.at_start == ("w", "test::World", "", None)
    assert plugin.layers == 2
    # A world plugin starts after the models of the file.
    assert plugin.models == ["m"]


def test_ports_have_resolved_topics(load: Any) -> None:
    world = load()
    assert set(world.ports.outputs) == {"/r1/out", "/loud"}
    assert set(world.ports.commands) == {"/r1/go"}
    one, two = world.model("m").plugins
    assert one.go.value.linear_x == 1.0
    world.command("/r1/go").set(Twist(linear_x=3.0))
    world.command("/r1/go").set(Twist(linear_x=-3.0))
    assert (one.go.value.linear_x, two.go.value.linear_x) == (3.0, 3.0)
    output = world.output("/r1/out")
    assert one.out.wanted
    world.step(2)
    assert output.latest == 0.005


def test_transforms_have_the_time_of_the_step(load: Any) -> None:
    world = load()
    world.step(3)
    assert world.transforms["a", "b"] == flatland.Transform(10_000_000, "a", "b", 1.0, 2.0, 0.5)


def test_random_numbers_depend_on_the_seed_and_the_names(load: Any) -> None:
    def numbers(seed: int) -> list[float]:
        return [float(plugin.rng.random()) for plugin in load(seed=seed).model("m").plugins]

    assert numbers(5) == numbers(5)
    assert len({*numbers(5), *numbers(6)}) == 4


def test_ports_and_transforms_are_closed_after_the_last_hook(load: Any) -> None:
    world = load()
    one, two = world.model("m").plugins
    world.step()
    world.delete_model("m")
    assert (one.out_at_the_end, two.out_at_the_end) == (False, False)
    assert one.out.closed
    assert (world.ports.outputs, world.ports.commands, world.transforms) == ({}, {}, {})
    with pytest.raises(PluginError, match='plugin "one" has ended and cannot open "late"'):
        one.output("late", float)
    with pytest.raises(PluginError, match='plugin "one" has ended and cannot open "late"'):
        one.command("late", float)
    one.send_transform("a", "b", 0.0, 0.0, 0.0)
    world.step()
    assert world.transforms == {}
