"""Functions that plugins have called before steps, and the removal of jobs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import flatland
from flatland import ModelPlugin
from flatland.runtime.batch import step_worlds

MODEL = """
bodies: [{{name: base, type: dynamic, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}]
plugins: [{{name: p, type: "test::{}"}}]
"""


class Repeating(ModelPlugin):
    """Has a function called before each step, which requests the next call itself."""

    def on_initialize(self, config: Any) -> None:
        self.times: list[int] = []
        self.on_update(lambda timekeeper: None, phase="before")
        self.on_update(lambda timekeeper: None, phase="before")
        self.on_update(lambda timekeeper: None)
        self.set_before_step(self.repeat)

    def repeat(self) -> None:
        self.times.append(self.world.timekeeper.sim_time_ns)
        self.set_before_step(self.repeat)


class Lazy(Repeating):
    """The same, without updates in which code is called."""

    def on_initialize(self, config: Any) -> None:
        self.times = []
        self.set_before_step(self.repeat)


class Mutual(Repeating):
    """Has two functions that request each other."""

    def repeat(self) -> None:
        self.times.append(self.world.timekeeper.sim_time_ns)
        self.set_before_step(self.other)

    def other(self) -> None:
        self.times.append(self.world.timekeeper.sim_time_ns)
        self.set_before_step(self.repeat)


class Immediate(ModelPlugin):
    """Passes a value to its function in the step in which an update sets it."""

    def on_initialize(self, config: Any) -> None:
        self.seen: list[tuple[str, int]] = []
        self.on_update(self.first, phase="before")
        self.on_update(self.second, phase="before")

    def first(self, timekeeper: Any) -> None:
        self.set_before_step(lambda: self.seen.append(("later", timekeeper.sim_time_ns)))

    def second(self, timekeeper: Any) -> None:
        self.seen.append(("second", timekeeper.sim_time_ns))


class Mistaken(ModelPlugin):
    """Declares an update for outputs that are none, in `on_initialize` or later."""

    is_late = False

    def on_initialize(self, config: Any) -> None:
        self.output_ = self.output("o", float)
        outputs: Any = [self.output_] if self.is_late else [None]
        self.update = self.on_update(self.change, outputs=outputs)

    def change(self, timekeeper: Any) -> None:
        self.update.outputs = [self.output_, None]  # type: ignore[list-item]


class Grouped(ModelPlugin):
    """Has updates that are prepared together, by a function of its own."""

    def on_initialize(self, config: Any) -> None:
        self.prepared = 0
        for _ in range(2):
            self.on_update(lambda timekeeper: None, prepare=self.prepare)

    def prepare(self, plugins: Any) -> None:
        self.prepared += 1


@pytest.fixture(autouse=True)
def _plugins(declare_plugins: Callable[..., None]) -> None:
    """Declares the plugins of this module."""
    declare_plugins(Repeating, Lazy, Mutual, Immediate, Grouped, Mistaken)


def plugin_of(world: flatland.World) -> Any:
    return world.model("robot").plugin("p")


@pytest.mark.parametrize("kind", ["Repeating", "Lazy", "Mutual"])
@pytest.mark.parametrize(
    "step",
    [
        lambda world: world.step(5),
        lambda world: [world.step() for _ in range(5)],
        lambda world: step_worlds([world], 5),
    ],
    ids=["run", "single", "batch"],
)
def test_a_function_that_requests_itself_is_called_once_before_each_step(
    files: Any, kind: str, step: Callable[[flatland.World], object]
) -> None:
    world = files.load_model(MODEL.format(kind))
    step(world)
    assert plugin_of(world).times == [n * 5_000_000 for n in range(5)]
    clone = world.clone()
    step(clone)
    assert plugin_of(clone).times == [n * 5_000_000 for n in range(10)]


def test_a_function_that_an_update_requests_is_called_after_it(files: Any) -> None:
    world = files.load_model(MODEL.format("Immediate"))
    world.step(2)
    assert plugin_of(world).seen == [
        (name, time) for time in (0, 5_000_000) for name in ("later", "second")
    ]


def test_functions_of_deleted_plugins_are_not_called(files: Any) -> None:
    world = files.load_model(MODEL.format("Lazy"))
    plugin = plugin_of(world)
    world.step(2)
    world.delete_model("robot")
    world.step(2)
    assert len(plugin.times) == 2


def test_groups_of_updates_end_with_the_last_of_their_plugins(files: Any) -> None:
    world = files.load_model(MODEL.format("Grouped"))
    jobs = world.plugin_host.jobs
    assert len(jobs._groups) == 1
    world.spawn_model("\n" + MODEL.format("Grouped"), "two", "two", pose=(3, 3, 0))
    first, second = plugin_of(world), world.model("two").plugin("p")
    assert len(jobs._groups) == 2
    world.step(3)
    assert (first.prepared, second.prepared) == (3, 3)
    world.delete_model("robot")
    assert list(jobs._groups) == [second.prepare]
    world.step(3)
    assert (first.prepared, second.prepared) == (3, 6)


def test_an_update_takes_outputs_only(files: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(flatland.PluginError, match="outputs must contain outputs of the plugin"):
        files.load_model(MODEL.format("Mistaken"))
    monkeypatch.setattr(Mistaken, "is_late", True)
    world = files.load_model(MODEL.format("Mistaken"))
    with pytest.raises(TypeError, match="outputs must contain outputs of the plugin, got None"):
        world.step()
    world.step()
    assert world.time == pytest.approx(0.01)
    assert plugin_of(world).update.outputs == (plugin_of(world).output_,)
