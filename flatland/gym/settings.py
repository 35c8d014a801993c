"""The parts of an environment, with defaults for navigation."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from flatland.checks import checked_count
from flatland.gym.actions import Action, VelocityAction
from flatland.gym.agents import Agent, find_agent
from flatland.gym.buildings import Buildings
from flatland.gym.endings import Ending, navigation_ending
from flatland.gym.observations import Observation
from flatland.gym.randomization import Randomization
from flatland.gym.rewards import Reward, navigation_reward
from flatland.gym.tasks import RandomGoal, Task
from flatland.gym.worlds import find_world
from flatland.world import World

if TYPE_CHECKING:
    from flatland.config.inputs import Params

DEFAULT_STEPS: Final = 300
"""Limit of an episode [steps]."""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The arguments that all environments have in common.

    Attributes:
        world: World file, or the name of an included world: `navigate`, `corridor`, `crowd`,
            `fleet`; or several buildings, one of which is drawn for each episode.
        agent: Name of the model that is controlled.
        laser: Name of its laser; None for the first one.
        command: Topic of its velocity command; None for the first one.
        task: Starts and goals.
        observation: What is observed.
        action: How actions are scaled.
        reward: The reward.
        ending: When an episode terminates.
        randomization: What differs between episodes besides starts, goals and buildings.
        max_steps: Number of steps after which an episode is truncated; None for no limit.
        physics_steps: Number of steps of the world in a step of the environment.
        step_size: Simulated time of a step of the world [s].
        params: Values of `param()` in YAML files.
    """

    world: str | os.PathLike[str] | Buildings = "navigate"
    agent: str = "robot"
    laser: str | None = None
    command: str | None = None
    task: Task = field(default_factory=RandomGoal)
    observation: Observation = field(default_factory=Observation)
    action: Action = field(default_factory=VelocityAction)
    reward: Reward = field(default_factory=navigation_reward)
    ending: Ending = field(default_factory=navigation_ending)
    randomization: Randomization = field(default_factory=Randomization)
    max_steps: int | None = DEFAULT_STEPS
    physics_steps: int = 20
    step_size: float = 0.005
    params: Params = None

    def __post_init__(self) -> None:
        for name in ("max_steps", "physics_steps"):
            value = getattr(self, name)
            if value is not None or name != "max_steps":
                object.__setattr__(self, name, checked_count(name, value))
        if not isinstance(self.world, str | os.PathLike | Buildings):
            raise TypeError(f"world must be a file, a name or Buildings, got {self.world!r}")
        for name, kind in _KINDS.items():
            value = getattr(self, name)
            if not isinstance(value, kind):
                raise TypeError(f"{name} must be a {kind.__name__}, got {value!r}")
        if not (math.isfinite(self.step_size) and self.step_size > 0):
            raise ValueError(f"step_size must be positive [s], got {self.step_size}")

    @classmethod
    def from_arguments(cls, arguments: Mapping[str, Any]) -> Settings:
        """Returns settings from keyword arguments.

        Raises:
            TypeError: An argument is unknown or has the wrong type.
            ValueError: A value is out of range.
        """
        known = [each.name for each in fields(cls)]
        unknown = sorted(set(arguments) - set(known))
        if unknown:
            raise TypeError(
                f"unknown argument {unknown[0]!r} of the environment; known: {', '.join(known)}"
            )
        return cls(**arguments)

    def limited_to(self, steps: int) -> Settings:
        """Returns settings whose episodes are truncated after a number of steps at the latest."""
        limit = steps if self.max_steps is None else min(steps, self.max_steps)
        return replace(self, max_steps=limit)

    @property
    def world_name(self) -> str:
        """The name of the world for users: of its file, or of the folder of a file `world.yaml`."""
        if isinstance(self.world, Buildings):
            return self.world.name
        path = Path(self.world)
        return path.parent.name if path.name == "world.yaml" and path.parent.name else path.stem

    @property
    def dt(self) -> float:
        """Simulated time of a step of the environment [s]."""
        return self.physics_steps * self.step_size

    @property
    def building_count(self) -> int:
        """Number of buildings."""
        return len(self.world) if isinstance(self.world, Buildings) else 1

    def load(self, building: int = 0) -> World:
        """Loads the world.

        Args:
            building: Index of the building.

        Raises:
            FlatlandError: A file is missing or invalid.
            ValueError: An argument of a generated building is out of range.
        """
        if isinstance(self.world, Buildings):
            return self.world.load(building, self.params, self.step_size)
        return World.from_yaml(
            find_world(self.world), seed=0, params=self.params, step_size=self.step_size
        )

    def find_agent(self, world: World, name: str | None = None) -> Agent:
        """Returns the agent of a world, by default the model `agent`.

        Raises:
            WorldError: The model does not exist, or has no laser or no velocity command.
        """
        return find_agent(world, name or self.agent, self.laser, self.command)


_KINDS: dict[str, type] = {
    "action": Action,
    "ending": Ending,
    "observation": Observation,
    "randomization": Randomization,
    "reward": Reward,
    "task": Task,
}
