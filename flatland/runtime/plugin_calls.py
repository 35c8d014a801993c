"""Calls of methods of plugins, which recordings contain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from flatland.errors import WorldError
from flatland.plugin_api.plugin import ModelPlugin

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.plugin_api.plugin import FlatlandPlugin


def recorded_method(
    plugin: FlatlandPlugin | str,
    method: str,
    model: str,
    world_plugins: Sequence[FlatlandPlugin],
    models: Mapping[str, Model],
) -> tuple[str, str, Callable[..., Any]]:
    """Returns the name of a plugin, the name of its model, and one of its methods.

    Args:
        plugin: As for `World.call_plugin`.
        method: As for `World.call_plugin`.
        model: As for `World.call_plugin`.
        world_plugins: All world plugins.
        models: All models by name.

    Raises:
        WorldError: The plugin or the method does not exist.
    """
    if isinstance(plugin, ModelPlugin):
        model = plugin.model.name
    name = plugin if isinstance(plugin, str) else plugin.name
    plugins = world_plugins
    if model:
        plugins = models[model].plugins if model in models else ()
    found = next((one for one in plugins if plugin in (one, one.name)), None)
    if found is None or method not in type(found).recorded_methods:
        what = f'plugin "{name}" of model "{model}"' if model else f'world plugin "{name}"'
        raise WorldError(f"{what} with the method {method} does not exist")
    return name, model, getattr(found, method)
