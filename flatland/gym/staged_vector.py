"""What vectors of environments have in common that take place on a stage."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from flatland.checks import checked_count, shown
from flatland.geometry import DoubleArray
from flatland.gym.env import FlatlandEnv
from flatland.gym.stage import Stage
from flatland.gym.staged import Staged
from flatland.runtime.batch import MAX_THREADS
from flatland.runtime.stepping import MAX_STEPS

if TYPE_CHECKING:
    from flatland.gym.agents import Agent
    from flatland.gym.settings import Settings
    from flatland.gym.stage import Image
    from flatland.world import World


class RegisteredLimit(int):
    """The limit of steps of a registered environment, which `max_steps` replaces.

    `gymnasium.make_vec` passes it as `max_episode_steps` unless this argument is given.
    """


def checked_autoreset_mode(mode: object) -> AutoresetMode:
    """Returns an autoreset mode, which may be given by its name or its value.

    Raises:
        ValueError: It is none.
    """
    for each in AutoresetMode:
        if isinstance(mode, str | AutoresetMode) and mode in (each, each.name, each.value):
            return each
    names = ", ".join(each.name for each in AutoresetMode)
    raise ValueError(f"autoreset_mode must be one of {names}, got {shown(mode)}")


class StagedVector(Staged, VectorEnv[Any, Any, Any]):
    """A vector of environments, one for each robot on a stage."""

    kept_attributes = ("spec", "_rngs", "_seeds")

    def _enter(
        self,
        settings: Settings,
        num_worlds: int,
        agents_of: Callable[[World], list[Agent]],
        *,
        autoreset_mode: AutoresetMode | str,
        num_threads: int,
        render_mode: str | None,
        web_port: int | None,
        max_episode_steps: int | None,
    ) -> None:
        """Loads the worlds, each with a random number generator of its own.

        Args:
            settings: The arguments of all environments.
            num_worlds: Number of worlds.
            agents_of: Returns the agents of a world.
            autoreset_mode: As for the constructor, like the others.
            num_threads: Number of threads, 0 for one per core.
            render_mode: `rgb_array`, `human` or None.
            web_port: Port of the viewer.
            max_episode_steps: Limit of the steps of an episode; None for that of the settings.
        """
        self.autoreset_mode = checked_autoreset_mode(autoreset_mode)
        num_threads = checked_count("num_threads", num_threads, 0, MAX_THREADS)
        if max_episode_steps is not None and not (
            isinstance(max_episode_steps, RegisteredLimit) and settings.max_steps is not None
        ):
            limit = checked_count("max_episode_steps", max_episode_steps, 1, MAX_STEPS)
            settings = settings.limited_to(limit)
        world_name = settings.world_name
        self._stage = Stage(
            settings,
            [f"{world_name} {number}" for number in range(num_worlds)],
            agents_of,
            render_mode=render_mode,
            web_port=web_port,
            metadata={**FlatlandEnv.metadata, "autoreset_mode": self.autoreset_mode},
            num_threads=num_threads,
        )
        self.render_mode = render_mode
        self.metadata = self._stage.metadata
        self._episodes = self._stage.episodes
        self.num_envs = len(self._episodes.agents)
        self.single_action_space = settings.action.space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.single_observation_space = self._episodes.layout.space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._rngs: list[np.random.Generator | None] = [None] * num_worlds
        self._seeds: list[int | None] = [None] * num_worlds
        self._has_begun = np.zeros(num_worlds, np.bool_)

    def _rng(self, number: int) -> np.random.Generator:
        """Returns the random number generator of a world."""
        rng = self._rngs[number]
        if rng is None:
            rng, self._seeds[number] = seeding.np_random()
            self._rngs[number] = rng
        return rng

    @property
    def worlds(self) -> tuple[World, ...]:
        """The worlds, which must be stepped only by the vector.

        With several buildings, each episode may be in another world.
        """
        return tuple(self._stage.worlds)

    @property
    def poses(self) -> DoubleArray:
        """A copy of the poses (x, y, theta) of all robots in the world frame, shape (num_envs, 3).

        They are those of the last observations [m, m, rad].
        """
        return self.episodes.situation.poses.copy()

    @property
    def goals(self) -> DoubleArray:
        """A copy of all goals (x, y) in the world frame [m], shape (num_envs, 2)."""
        return self.episodes.situation.goals.copy()

    def render(self) -> tuple[Image, ...] | None:
        """Returns an image of each world for `rgb_array`; for `human`, shows all worlds.

        Raises:
            ClosedEnvironmentError: The environments are closed.
            FlatlandError: The viewer cannot listen on its port, or matplotlib is missing.
        """
        images = self._stage.render()
        return None if images is None else tuple(images)

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002 - as in the base class
        """Closes all worlds and their views."""
        self._stage.close()
