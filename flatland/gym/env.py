"""A single environment with one agent."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import gymnasium
from gymnasium.error import ResetNeeded

from flatland.checks import checked_count, checked_options
from flatland.geometry import FloatArray
from flatland.gym.settings import Settings
from flatland.gym.stage import RENDER_MODES, Image, Stage
from flatland.gym.staged import Staged
from flatland.gym.tasks import Occupied

if TYPE_CHECKING:
    from flatland.gym.buildings import Buildings
    from flatland.world import World


class FlatlandEnv(Staged, gymnasium.Env[Any, FloatArray]):
    """A robot with a laser that drives to a goal.

    An action is a velocity command for `physics_steps` steps of the world. An episode depends on
    the seed of the reset and the actions only, not on earlier episodes.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as in the base class
        "render_modes": list(RENDER_MODES),
        "render_fps": 10,
    }
    kept_attributes = ("spec", "_np_random", "_np_random_seed")

    def __init__(
        self,
        world: str | os.PathLike[str] | Buildings = "navigate",
        render_mode: str | None = None,
        *,
        web_port: int | None = None,
        **arguments: Any,
    ) -> None:
        """Loads the world.

        Args:
            world: World file, or the name of an included world: `navigate`, `corridor`, `crowd`,
                `fleet`; or `Buildings`, one of which is drawn for each episode.
            render_mode: `rgb_array`, `human` or None.
            web_port: Port of the viewer of the render mode `human`, 0 for any free one; the first
                environment of a process determines it. None for the environment variable
                `FLATLAND_WEB_PORT`, or 8000.
            **arguments: See `Settings`.

        Raises:
            DependencyNotInstalled: `human` requires aiohttp.
            FlatlandError: A file is missing or invalid, or the model cannot be an agent.
            TypeError: An argument is unknown or has the wrong type.
            ValueError: An argument is out of range.
        """
        settings = Settings.from_arguments({"world": world, **arguments})
        action_space: Any = settings.action.space
        self._stage = Stage(
            settings,
            [settings.world_name],
            lambda world: [settings.find_agent(world)],
            render_mode=render_mode,
            web_port=web_port,
            metadata=self.metadata,
        )
        self.render_mode = render_mode
        self.metadata = self._stage.metadata
        self._episodes = self._stage.episodes
        self.observation_space = self._episodes.layout.space
        self.action_space = action_space
        self._running = False

    @property
    def world(self) -> World:
        """The world, which only the environment may step.

        With several buildings, each episode may be in another world.
        """
        return self._stage.worlds[0]

    @property
    def goal(self) -> tuple[float, float]:
        """The goal of the episode in the world frame [m]."""
        return self._stage.goals[0][0]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: Seed of the random numbers of this episode and the next ones.
            options: `start`, a pose, and `goal`, a place, in the world frame; the task chooses what
                is not given.

        Returns:
            The first observation and its info.

        Raises:
            ClosedEnvironmentError: The environment is closed.
            WorldError: No place is free, or no path leads to the start or the goal.
            ValueError: The seed is no integer of at least 0, or an option is unknown or invalid.
        """
        given = checked_options(options, ("goal", "start"))
        super().reset(seed=None if seed is None else checked_count("seed", seed, 0))
        self._stage.check_open()
        self._running = False
        self._stage.restore(0, self.np_random)
        self._episodes.begin(0, self.np_random, Occupied(), given)
        self._episodes.look()
        self._running = True
        self._stage.show()
        return self._observation(), self._episodes.info(0)

    def step(self, action: FloatArray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Carries out an action.

        Args:
            action: An element of the action space, such as forward speed and yaw rate from -1 to 1,
                shape (2,).

        Returns:
            Observation, reward, whether the episode terminated, whether it was truncated, info.

        Raises:
            ClosedEnvironmentError: The environment is closed.
            ResetNeeded: There was no reset, or the episode has ended.
            InvalidAction: The action has the wrong shape, is NaN, or no real number.
        """
        self._stage.check_open()
        if not self._running:
            raise ResetNeeded("call reset() before step(): no episode has begun, or it has ended")
        actions = self._episodes.read_actions(action, None)
        self._episodes.step(actions)
        rewards, terminated, truncated = self._episodes.judge()
        ended = bool(terminated[0]), bool(truncated[0])
        self._running = not any(ended)
        self._stage.show()
        return self._observation(), float(rewards[0]), *ended, self._episodes.info(0)

    def render(self) -> Image | None:
        """Returns an image for `rgb_array`; shows the world in the browser for `human`.

        Raises:
            ClosedEnvironmentError: The environment is closed.
            FlatlandError: The viewer cannot listen on its port, or matplotlib is missing.
        """
        return self._stage.image()

    def close(self) -> None:
        """Closes the world and its view; further calls have no effect."""
        self._stage.close()

    def _observation(self) -> Any:
        return self._episodes.layout.present(self._episodes.observations[0])
