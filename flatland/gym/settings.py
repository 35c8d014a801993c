"""The parts of an environment, with defaults for navigation."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from flatland.checks import check_kind, checked_count, checked_positive, shown
from flatland.gym.actions import Action, VelocityAction
from flatland.gym.agents import Agent, find_agent
from flatland.gym.buildings import Buildings
from flatland.gym.endings import Ending, EndingFunction, as_ending, navigation_ending
from flatland.gym.observations import Observation
from flatland.gym.randomization import Randomization
from flatland.gym.rewards import Reward, RewardFunction, as_reward, navigation_reward
from flatland.gym.tasks import RandomGoal, Task
from flatland.gym.worlds import find_world
from flatland.runtime.stepping import MAX_STEPS
from flatland.world import World

if TYPE_CHECKING:
    from flatland.config.inputs import Params

_MAX_REPEAT: Final = 1_000_000  # steps of the world in a step of the environment
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
        reward: The reward, or a function that computes it.
        ending: When an episode terminates, or a function that determines it.
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
    reward: Reward | RewardFunction = field(default_factory=navigation_reward)
    ending: Ending | EndingFunction = field(default_factory=navigation_ending)
    randomization: Randomization = field(default_factory=Randomization)
    max_steps: int | None = DEFAULT_STEPS
    physics_steps: int = 20
    step_size: float = 0.005
    params: Params = None

    def __post_init__(self) -> None:
        checked: dict[str, Any] = {
            "physics_steps": checked_count("physics_steps", self.physics_steps, 1, _MAX_REPEAT),
            "step_size": checked_positive("step_size", self.step_size, "s"),
            "reward": as_reward("reward", self.reward),
            "ending": as_ending("ending", self.ending),
        }
        if self.max_steps is not None:
            checked["max_steps"] = checked_count("max_steps", self.max_steps, 1, MAX_STEPS)
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        if not isinstance(self.world, str | os.PathLike | Buildings):
            raise TypeError(f"world must be a file, a name or Buildings, got {shown(self.world)}")
        for name, kind in _KINDS.items():
            check_kind(name, getattr(self, name), kind, f"a {kind.__name__}")

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
    "observation": Observation,
    "randomization": Randomization,
    "task": Task,
}
