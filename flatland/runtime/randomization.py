"""The random start of an episode."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from flatland.entities.model import Model
    from flatland.plugin_api.plugin import FlatlandPlugin


def randomize_plugins(
    models: Iterable[Model], world_plugins: Iterable[FlatlandPlugin], rng: np.random.Generator
) -> None:
    """Draws what the plugins of a world draw at the start of an episode.

    Args:
        models: The models; their plugins are first.
        world_plugins: The world plugins.
        rng: Source of all random numbers.

    Raises:
        WorldError: See `FlatlandPlugin.randomize`.
    """
    for model in models:
        for plugin in model.plugins:
            plugin.randomize(rng)
    for world_plugin in world_plugins:
        world_plugin.randomize(rng)
