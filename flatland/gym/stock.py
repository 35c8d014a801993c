"""The worlds of one building, for environments that change the building."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flatland.gym.agents import omit_first_calls

if TYPE_CHECKING:
    from flatland.gym.agents import Agent
    from flatland.runtime.snapshot import WorldSnapshot
    from flatland.world import World


@dataclass(frozen=True, slots=True, eq=False)
class PreparedWorld:
    """A world in which episodes take place.

    Attributes:
        building: Index of the building.
        world: The world.
        agents: Its agents.
        start: Its state before each episode.
    """

    building: int
    world: World
    agents: tuple[Agent, ...]
    start: WorldSnapshot


class Stock:
    """Equal worlds of one building, which share walls, trees and the copy of all bodies.

    Attributes:
        idle: Worlds that no environment uses, oldest first.
    """

    def __init__(
        self, building: int, original: World, find_agents: Callable[[World], list[Agent]]
    ) -> None:
        """Creates an empty stock.

        Args:
            building: Index of the building.
            original: The world that is copied; it has no agents, and does not change.
            find_agents: Returns the agents of a world.
        """
        self.idle: list[PreparedWorld] = []
        self._building = building
        self._original = original
        self._find_agents = find_agents
        self._shared: WorldSnapshot | None = None

    def prepare(self, world: World) -> PreparedWorld:
        """Prepares the original or a copy, which has not changed."""
        agents = tuple(self._find_agents(world))
        omit_first_calls(agents)
        start = world.snapshot(original=self._shared)
        if self._shared is None:
            self._shared = start
        return PreparedWorld(self._building, world, agents, start)

    def take(self) -> PreparedWorld:
        """Returns an idle world, or a new one."""
        return self.idle.pop() if self.idle else self.prepare(self._original.clone())

    def close(self) -> None:
        """Closes the original and all idle worlds."""
        for idle in self.idle:
            idle.world.close()
        self._original.close()
