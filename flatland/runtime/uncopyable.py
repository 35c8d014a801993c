"""Objects of a world that can be neither saved nor copied, and the plugins that have them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from flatland.copying.kind import UncopyableError
from flatland.copying.record import Recorder
from flatland.errors import WorldError
from flatland.plugin_api.plugin import FlatlandPlugin, describe

if TYPE_CHECKING:
    from flatland.copying.kind import Kind
    from flatland.world import World

Kinds = dict[type[Any], "Kind"]

_ADVICE: Final = (
    'the class can define __getstate__ and __setstate__, see "Snapshots" in docs/write_a_plugin.md'
)


def parts_outside(world: World) -> list[object]:
    """Returns the objects of a world that are not part of its state."""
    host = world.plugin_host
    costs = host.costs
    parts: list[object] = [world, world._states, world.requests, world._observers, host.registry]
    if costs is not None:
        parts += [costs, *vars(costs).values()]
    return parts


def located(world: World, kinds: Kinds, error: UncopyableError) -> WorldError:
    """Returns the error for an object that cannot be copied, with the plugin that has it."""
    for plugin in _plugins(world):
        name = _find_outside(world, kinds, plugin)
        if name:
            what = f'{describe(plugin)}: attribute "{name}"'
            return WorldError(f"{what} holds {error}, which cannot be copied; {_ADVICE}")
    return WorldError(f"the world holds {error}, which cannot be copied; {_ADVICE}")


def check_revivable(world: World, kinds: Kinds, plugin: FlatlandPlugin) -> None:
    """Checks that a deleted plugin was not connected to anything outside the world.

    Raises:
        WorldError: It was, and does not define how it is copied.
    """
    if type(plugin).__getstate__ is not vars(object)["__getstate__"]:
        return
    name = _find_outside(world, kinds, plugin)
    if name:
        raise WorldError(
            f'{describe(plugin)}: attribute "{name}" holds a connection that ended when the model '
            f"was deleted; {_ADVICE}"
        )


def _plugins(world: World) -> list[FlatlandPlugin]:
    of_models = [plugin for model in world.models for plugin in model.plugins]
    return [*of_models, *world.plugin_host.world_plugins]


def _find_outside(world: World, kinds: Kinds, plugin: FlatlandPlugin) -> str:
    """Returns the attribute of a plugin that cannot be copied, empty for none."""
    attributes = plugin.__getstate__()
    if not isinstance(attributes, dict):
        return ""
    others = [*parts_outside(world), *world.models, *_plugins(world), plugin]
    name: str
    for name, value in attributes.items():
        recorder = Recorder(kinds, others)
        try:
            recorder.record([value])
        except UncopyableError:
            return name
        if recorder.outside and name not in type(plugin).outside_state:
            return name
    return ""
