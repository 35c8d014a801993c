"""The state of a world at the start of all its episodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flatland.gym.agents import Agent
    from flatland.gym.settings import Settings
    from flatland.world import World


class StartState:
    def __init__(self, world: World, agents: Sequence[Agent]) -> None:
        self._world = world
        self._agents = agents

    def restore(self, rng: np.random.Generator) -> None:
        for agent in self._agents:
            for plugin in agent.model.plugins:
                if hasattr(plugin, "_velocity"):
                    plugin._velocity = plugin._yaw_rate = 0.0


def clone_worlds(settings: Settings, n: int) -> list[World]:
    """Returns `n` equal worlds; the first is loaded and the others are copies."""
    return [settings.load() for _ in range(n)]
