"""Several robots in one world, which begin their episodes together."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.gym.agents import Agent, check_alike
from flatland.gym.buildings import Buildings
from flatland.gym.settings import Settings
from flatland.gym.tasks import Occupied
from flatland.gym.worlds import included_robot
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.gym.episodes import Episodes
    from flatland.world import World

MAX_ROBOTS: Final = 10_000  # in a world


def fleet_settings(world: str | os.PathLike[str], arguments: Mapping[str, Any]) -> Settings:
    """Returns the settings of an environment with several robots.

    Raises:
        TypeError: An argument is unknown, has the wrong type, or is that of each robot.
        ValueError: A value is out of range.
    """
    for name in ("agent", "command"):
        if name in arguments:
            raise TypeError(f"{name} is not an argument here: it is that of each robot")
    if isinstance(world, Buildings):
        raise TypeError("world must be a file or a name: several robots have one building")
    return Settings.from_arguments({"world": world, **arguments})


def spawn_robots(
    world: World, names: Iterable[str], robot: str | os.PathLike[str] | None, settings: Settings
) -> list[Agent]:
    """Adds robots to a world.

    Args:
        world: The world.
        names: Names of the robots, which are also their namespaces.
        robot: Model file of the robots; None for the included one.
        settings: The arguments of the environment.

    Raises:
        FlatlandError: The file is missing or invalid, or the model cannot be an agent.
    """
    path = included_robot() if robot is None else robot
    agents: list[Agent] = []
    for name in names:
        # This pose is never simulated: each reset places all robots.
        world.spawn_model(path, name, name, if_blocked="allow")
        agents.append(settings.find_agent(world, name))
    check_alike(agents)
    return agents


def begin_together(episodes: Episodes, rows: Sequence[int], rng: np.random.Generator) -> None:
    """Begins the episodes of all agents of a world, which is in its initial state.

    Args:
        episodes: The episodes.
        rows: The agents of the world.
        rng: Source of the random numbers.

    Raises:
        WorldError: There is no room for all agents and goals.
    """
    agents = [episodes.agents[row] for row in rows]
    occupied = Occupied()
    for number, row in enumerate(rows):
        others = agents[number + 1 :]
        occupied.unplaced = [body for agent in others for body in agent.model.bodies]
        episodes.begin(row, rng, occupied, {})
        x, y = episodes.situation.goals[row].tolist()
        occupied.goals.append((x, y))
        stop(agents[number])


def stop(agent: Agent) -> None:
    """Stops an agent; its drive brakes within its limits."""
    agent.command.set(Twist())
