"""Several robots in one world, with the parallel API of PettingZoo."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from flatland.checks import checked_count
from flatland.geometry import FloatArray
from flatland.gym.robots import MAX_ROBOTS, begin_together, fleet_settings, spawn_robots, stop
from flatland.gym.stage import RENDER_MODES, Image, Stage
from flatland.gym.staged import Staged

Steps = tuple[
    dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]
]


class FleetEnv(Staged, ParallelEnv[str, Any, FloatArray]):  # type: ignore[misc, unused-ignore]
    """Robots that drive to their goals in the same world, as obstacles in the scans of the others.

    A robot whose episode has ended stops and remains in the world as an obstacle.

    Attributes:
        world: The world.
        possible_agents: Names of all robots.
        agents: Names of the robots whose episodes have not ended.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - the base class has no ClassVar
        "name": "flatland/Fleet-v0",
        "render_modes": list(RENDER_MODES),
        "render_fps": 10,
        "is_parallelizable": True,
    }
    kept_attributes = ("_rng",)

    def __init__(
        self,
        num_robots: int = 4,
        world: str | os.PathLike[str] = "fleet",
        *,
        robot: str | os.PathLike[str] | None = None,
        render_mode: str | None = None,
        web_port: int | None = None,
        **arguments: Any,
    ) -> None:
        """Loads the world and adds the robots.

        Args:
            num_robots: Number of robots, which are added as `robot_0`, `robot_1`, …
            world: World file, or the name of an included world.
            robot: Model file of the robots; None for the included one.
            render_mode: `rgb_array`, `human` or None.
            web_port: Port of the viewer of the render mode `human`, see `FlatlandEnv`.
            **arguments: See `Settings`, except for `agent` and `command`.

        Raises:
            DependencyNotInstalled: `human` requires aiohttp.
            FlatlandError: A file is missing or invalid, or the model cannot be an agent.
            TypeError: An argument is unknown or has the wrong type.
            ValueError: An argument is out of range.
        """
        num_robots = checked_count("num_robots", num_robots, 1, MAX_ROBOTS)
        settings = fleet_settings(world, arguments)
        self.possible_agents = [f"robot_{i}" for i in range(num_robots)]
        self.agents: list[str] = []
        self._row_of = {name: row for row, name in enumerate(self.possible_agents)}
        self._action_spaces = dict.fromkeys(self.possible_agents, settings.action.space)
        self._stage = Stage(
            settings,
            [settings.world_name],
            lambda world: spawn_robots(world, self.possible_agents, robot, settings),
            render_mode=render_mode,
            web_port=web_port,
            metadata=self.metadata,
        )
        self.render_mode = render_mode
        self.metadata = self._stage.metadata
        self.world = self._stage.worlds[0]
        self._episodes = self._stage.episodes
        self._agents = self._episodes.agents
        self._observation_space = self._episodes.layout.space
        self._rng: np.random.Generator | None = None

    def observation_space(self, agent: str) -> spaces.Space[Any]:  # noqa: ARG002
        """Returns the observation space, the same for all robots."""
        return self._observation_space

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the action space of a robot."""
        return self._action_spaces[agent]

    @property
    def goals(self) -> dict[str, tuple[float, float]]:
        """The goals of all robots in the world frame [m]."""
        return dict(zip(self.possible_agents, self._stage.goals[0], strict=True))

    def reset(
        self,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002 - there are no options
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Begins an episode for all robots.

        Args:
            seed: Seed of the random numbers of this episode and the next ones.
            options: Ignored, as in other environments of PettingZoo.

        Returns:
            The first observations and infos by the names of the robots.

        Raises:
            ClosedEnvironmentError: The environment is closed.
            WorldError: There is no room for all robots and goals.
        """
        self._stage.check_open()
        if seed is not None or self._rng is None:
            seed = None if seed is None else checked_count("seed", seed, 0)
            self._rng, _ = seeding.np_random(seed)
        self.agents = []
        self._stage.restore(0, self._rng)
        begin_together(self._episodes, range(len(self._agents)), self._rng)
        self._episodes.look()
        self.agents = list(self.possible_agents)
        self._stage.show()
        return self._observations(self.agents), self._infos(self.agents)

    def step(self, actions: dict[str, FloatArray]) -> Steps:
        """Carries out an action of each robot whose episode has not ended.

        Args:
            actions: Elements of the action space by the names in `agents`.

        Returns:
            Observations, rewards, whether episodes terminated, whether they were truncated, and
            infos, by the names of the robots that acted.

        Raises:
            ClosedEnvironmentError: The environment is closed.
            ResetNeeded: There was no reset, or all episodes have ended.
            InvalidAction: An action is missing, has the wrong shape, is NaN, or is of a robot that
                does not exist or whose episode has ended.
        """
        self._stage.check_open()
        if not self.agents:
            raise ResetNeeded("call reset() before step(): no episode has begun, or all have ended")
        live = list(self.agents)
        if set(actions) != set(live):
            raise InvalidAction(
                f"actions must be those of {', '.join(live)}, got {', '.join(actions) or 'none'}"
            )
        rows = np.array([self._row_of[name] for name in live])
        numbers = np.zeros_like(self._episodes.situation.actions)
        numbers[rows] = self._episodes.read_actions([actions[name] for name in live], len(live))
        self._episodes.step(numbers, rows)
        rewards, terminated, truncated = self._episodes.judge()
        ended = terminated | truncated
        for name in live:
            if ended[self._row_of[name]]:
                stop(self._agents[self._row_of[name]])
        self.agents = [name for name in live if not ended[self._row_of[name]]]
        self._stage.show()
        return (
            self._observations(live),
            {name: float(rewards[self._row_of[name]]) for name in live},
            {name: bool(terminated[self._row_of[name]]) for name in live},
            {name: bool(truncated[self._row_of[name]]) for name in live},
            self._infos(live),
        )

    def state(self) -> npt.NDArray[np.float32]:
        """Returns the pose, velocity and goal of all robots, shape (8 * number of robots,).

        Each robot has (x, y, theta, vx, vy, omega, goal_x, goal_y) in the world frame [m, rad, s].
        """
        s = self._episodes.situation
        return np.concatenate([s.poses, s.velocities, s.goals], axis=1).astype(np.float32).ravel()

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

    def _observations(self, names: list[str]) -> dict[str, Any]:
        present, numbers = self._episodes.layout.present, self._episodes.observations
        return {name: present(numbers[self._row_of[name]]) for name in names}

    def _infos(self, names: list[str]) -> dict[str, dict[str, Any]]:
        return {name: self._episodes.info(self._row_of[name]) for name in names}
