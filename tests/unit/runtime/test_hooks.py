"""The table of hooks: called plugins, their order, and the contacts that concern them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from flatland import ModelPlugin, WorldPlugin
from flatland.runtime.hooks import HookTable, overrides


class OfModel(ModelPlugin):
    def __init__(self, model: Any, name: str = "plugin") -> None:
        self.model, self.name = model, name

    def before_physics_step(self, timekeeper: Any) -> None:
        pass

    def begin_contact(self, contact: Any) -> None:
        pass


class OfAllModels(OfModel):
    all_contacts = True


class OfWorld(WorldPlugin):
    def before_physics_step(self, timekeeper: Any) -> None:
        pass

    def begin_contact(self, contact: Any) -> None:
        pass


def body_of(entity: object) -> Any:
    return SimpleNamespace(entity=entity)


def plugins(hooks: Any) -> list[Any]:
    return [plugin for plugin, _ in hooks]


def test_only_overridden_hooks_are_called() -> None:
    plugin: Any = OfModel(object())
    assert overrides(plugin, "before_physics_step")
    assert not overrides(plugin, "after_physics_step")
    assert not overrides(WorldPlugin(), "pre_solve")
    plugin.pre_solve = lambda contact, manifold: None
    assert overrides(plugin, "pre_solve")
    table = HookTable()
    table.add(plugin)
    assert plugins(table.of_step("before_physics_step")) == [plugin]
    assert plugins(table.of_step("after_physics_step")) == []
    assert table.has_any("pre_solve")
    assert not table.has_any("end_contact", "post_solve")


def test_world_plugins_come_after_model_plugins_that_are_loaded_later() -> None:
    table, model = HookTable(), object()
    first, world, second = OfModel(model), OfWorld(), OfModel(model)
    for plugin in (first, world, second):
        table.add(plugin)
    assert plugins(table.of_step("before_physics_step")) == [first, second, world]
    contact = table.of_contact("begin_contact", body_of(model), body_of(object()))
    assert plugins(contact) == [first, second, world]


def test_a_removed_plugin_is_not_called() -> None:
    table, model = HookTable(), object()
    removed, kept = OfModel(model), OfModel(model)
    table.add(removed)
    table.add(kept)
    running = table.of_step("before_physics_step")
    table.remove(removed)
    table.remove(removed)
    assert plugins(table.of_step("before_physics_step")) == [kept]
    assert plugins(table.of_contact("begin_contact", body_of(model), body_of(model))) == [kept]
    assert plugins(running) == [removed, kept]  # a loop over the hooks is not affected


@pytest.mark.parametrize("swapped", [False, True])
def test_a_contact_concerns_the_plugins_of_its_models_in_order_of_loading(swapped: bool) -> None:
    table, a, b, c = HookTable(), object(), object(), object()
    first, second, other = OfModel(a), OfModel(b), OfModel(c)
    everywhere = OfAllModels(c)
    for plugin in (first, other, everywhere, second):
        table.add(plugin)
    bodies = (body_of(b), body_of(a)) if swapped else (body_of(a), body_of(b))
    assert plugins(table.of_contact("begin_contact", *bodies)) == [first, everywhere, second]
    table.remove(everywhere)
    assert plugins(table.of_contact("begin_contact", *bodies)) == [first, second]
    assert plugins(table.of_contact("begin_contact", body_of(object()), body_of(0))) == []


def test_a_contact_within_one_model_is_reported_once() -> None:
    table, model = HookTable(), object()
    plugin = OfModel(model)
    table.add(plugin)
    hooks = table.of_contact("begin_contact", body_of(model), body_of(model))
    assert plugins(hooks) == [plugin]


def test_only_bodies_whose_contacts_concern_a_plugin_are_returned() -> None:
    table, model = HookTable(), object()
    bodies = [body_of(model), body_of(object())]
    assert list(table.bodies_concerned("begin_contact", bodies)) == []
    table.add(OfModel(model))
    assert list(table.bodies_concerned("begin_contact", bodies)) == bodies[:1]
    table.add(OfWorld())
    assert list(table.bodies_concerned("begin_contact", bodies)) == bodies


def test_hooks_can_be_wrapped_and_unwrapped() -> None:
    table, model, calls = HookTable(), object(), []
    early, late = OfModel(model, "early"), OfModel(model, "late")
    table.add(early)
    table.wrap(lambda plugin, hook: lambda *_: calls.append(plugin))
    table.add(late)
    for _, hook in table.of_step("before_physics_step"):
        hook(None)
    for _, hook in table.of_contact("begin_contact", body_of(model), body_of(model)):
        hook(None)
    assert calls == [early, late, early, late]
    table.wrap(None)
    for _, hook in table.of_step("before_physics_step"):
        hook(None)
    assert len(calls) == 4


def test_version_changes_with_the_hooks() -> None:
    table, plugin = HookTable(), OfModel(object())
    versions = [table.version]
    table.add(plugin)
    versions.append(table.version)
    table.remove(plugin)
    versions.append(table.version)
    assert len(set(versions)) == 3
