"""Several worlds with several robots each, as one vector with a row for each robot."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode

from flatland.checks import checked_count, checked_options
from flatland.errors import WorldError
from flatland.geometry import BoolArray, DoubleArray
from flatland.gym.robots import MAX_ROBOTS, begin_together, fleet_settings, spawn_robots, stop
from flatland.gym.staged_vector import StagedVector
from flatland.gym.vector import MAX_ENVS, checked_mask, checked_seeds, masked_infos


class FleetVectorEnv(StagedVector):
    """Worlds with several robots, each of which is an environment of the vector.

    The robots of world w are the environments from w * num_robots on. They have the results of a
    `FleetEnv` with the seed of the first of them, for any number of threads.

    The episodes of the robots of a world begin together. A robot whose episode has ended stops and
    remains as an obstacle until the last one of its world has ended: until then, it ignores
    actions, its observation is blank (zeros), its reward is 0, and it is not terminated again. The
    info `is_active` is whether an action was carried out.
    """

    def __init__(
        self,
        num_envs: int = 1,
        world: str | os.PathLike[str] = "fleet",
        *,
        num_robots: int = 4,
        robot: str | os.PathLike[str] | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        num_threads: int = 0,
        render_mode: str | None = None,
        web_port: int | None = None,
        max_episode_steps: int | None = None,
        **arguments: Any,
    ) -> None:
        """Loads the world, copies it, and adds the robots.

        Args:
            num_envs: Number of worlds; that of the environments is greater by `num_robots` times.
            world: World file, or the name of an included world.
            num_robots: Number of robots in each world.
            robot: Model file of the robots; None for the included one.
            autoreset_mode: When the episodes of a world that have all ended are followed by the
                next ones; see `gymnasium.vector.AutoresetMode`.
            num_threads: Number of threads, 0 for one per core.
            render_mode: `rgb_array`, `human` or None.
            web_port: Port of the viewer of the render mode `human`, see `FlatlandEnv`.
            max_episode_steps: Number of steps after which an episode is truncated, as Gymnasium
                names it; the lower one of this and `max_steps` is the limit.
            **arguments: See `Settings`, except for `agent` and `command`.

        Raises:
            DependencyNotInstalled: `human` requires aiohttp.
            FlatlandError: A file is missing or invalid, or the model cannot be an agent.
            MemoryError: There is not enough memory for that many worlds.
            TypeError: An argument is unknown or has the wrong type.
            ValueError: An argument is out of range.
        """
        super().__init__()
        self.num_worlds = checked_count("num_envs", num_envs, 1, MAX_ENVS)
        self.num_robots = checked_count("num_robots", num_robots, 1, MAX_ROBOTS)
        settings = fleet_settings(world, arguments)
        names = [f"robot_{number}" for number in range(self.num_robots)]
        self._enter(
            settings,
            self.num_worlds,
            lambda world: spawn_robots(world, names, robot, settings),
            autoreset_mode=autoreset_mode,
            num_threads=num_threads,
            render_mode=render_mode,
            web_port=web_port,
            max_episode_steps=max_episode_steps,
        )
        self._is_running = np.zeros(self.num_envs, np.bool_)

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random number generators of the environments; those of a world share one."""
        rngs = [self._rng(number) for number in range(self.num_worlds)]
        return tuple(rng for rng in rngs for _ in range(self.num_robots))

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """The seeds of these generators."""
        return tuple(seed for seed in self._seeds for _ in range(self.num_robots))

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begins the episodes of all worlds, or of those in `options["reset_mask"]`.

        Args:
            seed: Seed of the first environment, which is increased by one for each of the others,
                or a list of all seeds. A world uses that of its first robot.
            options: `reset_mask`, bools of shape (num_envs,), with the same value for all robots of
                a world.

        Returns:
            The observations of all environments, and the info of those that were reset.

        Raises:
            ClosedEnvironmentError: The environments are closed.
            WorldError: There is no room for all robots and goals of a world.
            TypeError: The mask is not an array of bools.
            ValueError: An option or the number of seeds is invalid.
        """
        self._stage.check_open()
        given = checked_options(options, ("reset_mask",))
        mask = checked_mask("reset_mask", given.get("reset_mask"), self.num_envs)
        of_worlds = mask.reshape(self.num_worlds, self.num_robots)
        if not mask.any() or (of_worlds.any(axis=1) != of_worlds.all(axis=1)).any():
            raise ValueError(
                'options["reset_mask"] must contain True, and the same value for the '
                f"{self.num_robots} robots of a world"
            )
        worlds = np.flatnonzero(of_worlds[:, 0]).tolist()
        seeds = checked_seeds(seed, self.num_envs)[:: self.num_robots]
        for number in worlds:
            if seeds[number] is not None:
                self._rngs[number], self._seeds[number] = seeding.np_random(seeds[number])
        self._begin(worlds)
        self._episodes.look(None if mask.all() else np.flatnonzero(mask))
        self._stage.show()
        return self._present(self._is_running), masked_infos(self._episodes, mask)

    def step(self, actions: Any) -> tuple[Any, DoubleArray, BoolArray, BoolArray, dict[str, Any]]:
        """Carries out the actions of all robots whose episodes have not ended.

        Args:
            actions: An action for each environment; those of others are ignored.

        Returns:
            Observations, rewards, which episodes terminated, which were truncated, infos. The
            autoreset mode defines what they contain for worlds in which all episodes have ended.

        Raises:
            ClosedEnvironmentError: The environments are closed.
            ResetNeeded: There was no reset, or, without autoreset, all episodes of a world have
                ended.
            InvalidAction: The actions are not elements of the action space.
        """
        self._stage.check_open()
        if not self._has_begun.all():
            raise ResetNeeded("call reset() before step(): no episode has begun")
        numbers = self._episodes.read_actions(actions, self.num_envs)
        over = self._worlds_that_are_over()
        if over and self.autoreset_mode is AutoresetMode.DISABLED:
            raise ResetNeeded(
                f"all episodes of world {over[0]} have ended: call reset() with "
                'options={"reset_mask": ...} before step()'
            )
        active, running = self._is_running.copy(), self._is_running.copy()
        # Only in the mode NEXT_STEP are there any.
        running.reshape(self.num_worlds, self.num_robots)[over] = True
        self._episodes.step(
            numbers,
            None if active.all() else np.flatnonzero(active),
            None if running.all() else np.flatnonzero(running),
            meanwhile=lambda: self._begin(over),
        )
        rewards, terminated, truncated = self._episodes.judge()
        rewards[~active] = 0.0
        terminated &= active
        truncated &= active
        ended = terminated | truncated
        self._is_running &= ~ended
        for row in np.flatnonzero(ended).tolist():
            stop(self._episodes.agents[row])
        shown = self._is_running | ended
        infos: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            infos = self._finish(ended) if ended.any() else {}
            shown = self._is_running
        everyone = np.ones(self.num_envs, np.bool_)
        infos.update(masked_infos(self._episodes))
        infos.update({"is_active": active, "_is_active": everyone})
        self._stage.show()
        return self._present(shown), rewards, terminated, truncated, infos

    def _worlds_that_are_over(self) -> list[int]:
        running = self._is_running.reshape(self.num_worlds, self.num_robots)
        over: list[int] = np.flatnonzero(~running.any(axis=1)).tolist()
        return over

    def _begin(self, worlds: Sequence[int]) -> None:
        """Begins the episodes of worlds."""
        for number in worlds:
            self._has_begun[number] = False
            rng = self._rng(number)
            self._stage.restore(number, rng)
            rows = range(number * self.num_robots, (number + 1) * self.num_robots)
            try:
                begin_together(self._episodes, rows, rng)
            except WorldError as error:
                raise WorldError(f"world {number}: {error.message}") from error
            self._has_begun[number] = self._is_running[rows.start : rows.stop] = True

    def _finish(self, ended: BoolArray) -> dict[str, Any]:
        """Returns the results of episodes, and begins those of the worlds that are over."""
        observations = np.full(self.num_envs, None, dtype=object)
        for row in np.flatnonzero(ended).tolist():
            observations[row] = self._episodes.layout.present(self._episodes.observations[row])
        infos = {
            "final_obs": observations,
            "_final_obs": ended.copy(),
            "final_info": masked_infos(self._episodes, ended),
            "_final_info": ended.copy(),
        }
        over = self._worlds_that_are_over()
        if over:
            self._begin(over)
            rows = np.add.outer(np.array(over) * self.num_robots, np.arange(self.num_robots))
            self._episodes.look(rows.ravel())
        return infos

    def _present(self, shown: BoolArray) -> Any:
        """Returns the observations of all environments, blank ones of those not in `shown`."""
        layout, numbers = self._episodes.layout, self._episodes.observations
        return layout.present(np.where(shown[:, np.newaxis], numbers, layout.blank), copy=False)
