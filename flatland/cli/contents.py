"""Texts about the contents of a world."""

from __future__ import annotations

from collections.abc import Sequence

from flatland.plugin_api.plugin import FlatlandPlugin
from flatland.world import World


def print_contents(world: World) -> None:
    """Prints one line for each layer and model, and for the world plugins."""
    for layer in world.layers:
        text = f"layer {', '.join(layer.names)}: {counted(len(layer.edges), 'edge')}"
        if layer.unknown_map_keys:
            text += f"; unknown keys in the map file: {', '.join(layer.unknown_map_keys)}"
        print(text)
    for model in world.models:
        parts = [
            counted(len(model.bodies), "body", "bodies"),
            counted(len(model.joints), "joint"),
        ]
        print(f"model {model.name}: {', '.join(parts)}{_plugins(model.plugins)}")
    if world.plugins:
        print(f"world{_plugins(world.plugins)}")


def counted(number: int, one: str, many: str = "") -> str:
    """Returns a number with a noun in the singular or plural."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def _plugins(plugins: Sequence[FlatlandPlugin]) -> str:
    names = ", ".join(f"{plugin.name} ({plugin.type})" for plugin in plugins)
    return f"; plugins: {names}" if names else ""
