"""The state of a world at the start of all its episodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flatland.gym.settings import Settings
    from flatland.world import World


class StartState:
    """The state of a world before any episode, to which each episode returns exactly."""

    def __init__(self, world: World) -> None:
        """Stores the current state of the world."""
        self._world = world
        self._snapshot = world.snapshot()

    def restore(self, rng: np.random.Generator) -> None:
        """Returns to the state, with new random numbers of all plugins.

        Args:
            rng: Source of the seeds; the noise is a function of its state.
        """
        world = self._world
        world.restore(self._snapshot)
        for model in world.models:
            for plugin in model.plugins:
                plugin.reseed(rng)
        for world_plugin in world.plugins:
            world_plugin.reseed(rng)


def clone_worlds(settings: Settings, n: int) -> list[World]:
    """Returns `n` equal worlds; the first is loaded and the others are copies.

    Raises:
        FlatlandError: A file is missing or invalid.
    """
    first = settings.load()
    return [first, *(first.clone() for _ in range(n - 1))]
