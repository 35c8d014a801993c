"""Contact hooks are called for the contacts of the plugin's own model and for no others."""

from __future__ import annotations

from typing import Any

import pytest

import flatland
from flatland import Contact, ModelPlugin

HOOKS = ("begin_contact", "pre_solve", "post_solve", "end_contact")
SPACING = 0.398  # m between discs of 0.4 m: each touches its neighbors
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{name: recorder, type: 'test::Recorder'}]
"""


class Recorder(ModelPlugin):
    """Records the names of the models of each contact, by hook."""

    def on_initialize(self, config: Any) -> None:
        self.calls: dict[str, list[set[str]]] = {hook: [] for hook in HOOKS}
        for hook in HOOKS:
            setattr(self, hook, lambda contact, *_, hook=hook: self._record(hook, contact))

    def _record(self, hook: str, contact: Contact) -> None:
        self.calls[hook].append({contact.body_a.entity.name, contact.body_b.entity.name})


@pytest.fixture
def row(files: Any, declare_plugins: Any) -> Any:
    """Returns a function that runs a row of touching robots and returns their recorders."""
    declare_plugins(Recorder)
    files.write("robot.model.yaml", ROBOT)

    def run(count: int) -> list[Recorder]:
        world: flatland.World = files.load("{properties: {}, layers: [{name: 2d}]}")
        for index in range(count):
            world.spawn_model("robot.model.yaml", str(index), pose=(SPACING * index, 0, 0))
        world.step()
        recorders: list[Any] = [model.plugins[0] for model in world.models]
        for model in world.models[1::2]:
            world.move_model(model.name, (SPACING * int(model.name), 50, 0))
        world.step()
        return recorders

    return run


@pytest.mark.parametrize("count", [2, 10])
def test_the_number_of_calls_is_proportional_to_the_number_of_contacts(
    row: Any, count: int
) -> None:
    recorders = row(count)
    for hook in HOOKS:
        calls = sum(len(recorder.calls[hook]) for recorder in recorders)
        assert calls == 2 * (count - 1), hook


def test_contacts_of_a_new_model_are_reported_although_another_one_is_deleted(row: Any) -> None:
    world = row(1)[0].world
    world.spawn_model("minimal.model.yaml", "other", pose=(9, 0, 0))
    world.step()
    world.spawn_model("minimal.model.yaml", "disc", pose=(SPACING, 20, 0))
    recorder = world.spawn_model("robot.model.yaml", "new", pose=(0, 20, 0)).plugins[0]
    world.delete_model("other")
    world.step()
    assert recorder.calls["begin_contact"] == [{"disc", "new"}]
