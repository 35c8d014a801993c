"""Many environments of the same kind, stepped together."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode

from flatland.checks import checked_count, checked_options, shown
from flatland.errors import WorldError
from flatland.geometry import BoolArray, DoubleArray
from flatland.gym.settings import Settings
from flatland.gym.situation import Rows
from flatland.gym.staged_vector import StagedVector
from flatland.gym.tasks import Occupied

if TYPE_CHECKING:
    from flatland.gym.buildings import Buildings
    from flatland.gym.episodes import Episodes

MAX_ENVS: Final = 1_000_000


class FlatlandVectorEnv(StagedVector):
    """Equal environments whose worlds are stepped and scanned over all cores.

    Each environment gives the same numbers as a `FlatlandEnv` of the same seed, for any number of
    threads.
    """

    def __init__(
        self,
        num_envs: int = 1,
        world: str | os.PathLike[str] | Buildings = "navigate",
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        num_threads: int = 0,
        copy: bool = True,
        render_mode: str | None = None,
        web_port: int | None = None,
        max_episode_steps: int | None = None,
        **arguments: Any,
    ) -> None:
        """Loads the world and copies it.

        Args:
            num_envs: Number of environments.
            world: World file, or the name of an included world: `navigate`, `corridor`, `crowd`,
                `fleet`; or `Buildings`, one of which is drawn for each episode of each environment.
            autoreset_mode: When an episode that has ended is followed by the next one; see
                `gymnasium.vector.AutoresetMode`.
            num_threads: Number of threads, 0 for one per core.
            copy: Whether `reset` and `step` return copies of the observations. Otherwise, the next
                call changes the arrays that they returned.
            render_mode: `rgb_array`, `human` or None.
            web_port: Port of the viewer of the render mode `human`, see `FlatlandEnv`.
            max_episode_steps: Number of steps after which an episode is truncated, as Gymnasium
                names it; the lower one of this and `max_steps` is the limit.
            **arguments: See `Settings`.

        Raises:
            DependencyNotInstalled: `human` requires aiohttp.
            FlatlandError: A file is missing or invalid, or the model cannot be an agent.
            MemoryError: There is not enough memory for that many environments.
            TypeError: An argument is unknown or has the wrong type.
            ValueError: An argument is out of range.
        """
        super().__init__()
        settings = Settings.from_arguments({"world": world, **arguments})
        self._enter(
            settings,
            checked_count("num_envs", num_envs, 1, MAX_ENVS),
            lambda world: [settings.find_agent(world)],
            autoreset_mode=autoreset_mode,
            num_threads=num_threads,
            render_mode=render_mode,
            web_port=web_port,
            max_episode_steps=max_episode_steps,
        )
        self.copy = copy
        self._has_ended = np.zeros(self.num_envs, np.bool_)

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random number generators of the environments."""
        return tuple(self._rng(row) for row in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """The seeds of the random number generators."""
        return tuple(self._seeds)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begins an episode in all environments, or in the selection `options["reset_mask"]`.

        Args:
            seed: Seed of the first environment, which is increased by one for each of the others,
                or a list of all seeds.
            options: `start`, a pose (x, y, theta), and `goal`, a place (x, y), in the world frame
                [m, rad]: either one for all environments, or one for each, shape (num_envs, 3) and
                (num_envs, 2). The masks `reset_mask`, `start_mask` and `goal_mask`, bools of shape
                (num_envs,), select the environments that are reset, and those to which `start` and
                `goal` apply; the task chooses the others.

        Returns:
            The observations of all environments, and the info of those that were reset.

        Raises:
            ClosedEnvironmentError: The environments are closed.
            WorldError: No place is free, or no path leads to the start or the goal; the number of
                the environment is in the text. It has no episode then.
            TypeError: A mask is not an array of bools.
            ValueError: An option or the number of seeds is invalid.
        """
        self._stage.check_open()
        mask, places = _checked_options(options, self.num_envs)
        rows = np.flatnonzero(mask)
        seeds = checked_seeds(seed, self.num_envs)
        for row in rows.tolist():
            if seeds[row] is not None:
                self._rngs[row], self._seeds[row] = seeding.np_random(seeds[row])
        self._begin(rows, places)
        self._episodes.look(None if len(rows) == self.num_envs else rows)
        self._stage.show()
        return self._present(), masked_infos(self._episodes, mask)

    def step(self, actions: Any) -> tuple[Any, DoubleArray, BoolArray, BoolArray, dict[str, Any]]:
        """Carries out one action in each environment.

        Args:
            actions: An action for each environment, such as forward speed and yaw rate from -1 to
                1, shape (num_envs, 2).

        Returns:
            Observations, rewards, which episodes terminated, which were truncated, infos. The
            autoreset mode defines what they contain for episodes that end.

        Raises:
            ClosedEnvironmentError: The environments are closed.
            ResetNeeded: There was no reset, or, without autoreset, an episode has ended.
            InvalidAction: The actions have the wrong shape, are NaN, or no real numbers.
        """
        self._stage.check_open()
        if not self._has_begun.all():
            raise ResetNeeded("call reset() before step(): no episode has begun")
        if self.autoreset_mode is AutoresetMode.DISABLED and self._has_ended.any():
            row = int(self._has_ended.argmax())
            raise ResetNeeded(
                f"the episode of environment {row} has ended: call reset() with "
                'options={"reset_mask": ...} before step()'
            )
        numbers = self._episodes.read_actions(actions, self.num_envs)
        # Only in the mode NEXT_STEP has any episode ended here.
        fresh = self._has_ended.copy()
        if fresh.any():
            (begun,) = fresh.nonzero()
            (acting,) = (~fresh).nonzero()
            self._episodes.step(numbers, acting, meanwhile=lambda: self._begin(begun))
        else:
            self._episodes.step(numbers)
        rewards, terminated, truncated = self._episodes.judge()
        rewards[fresh] = 0.0
        terminated[fresh] = truncated[fresh] = False
        ended = terminated | truncated
        infos: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            if ended.any():
                infos = self._finish(ended)
            self._has_ended = np.zeros(self.num_envs, np.bool_)
        else:
            self._has_ended = ended
        infos.update(masked_infos(self._episodes))
        self._stage.show()
        return self._present(), rewards, terminated, truncated, infos

    def step_rows(self, actions: Any, rows: BoolArray) -> BoolArray:
        """Carries out the actions of some environments; those whose episodes end begin no other.

        Each of these must be reset before a call of `step`. `evaluate` uses this.

        Args:
            actions: An action for each environment; those of others must be valid, but have no
                effect.
            rows: The environments, shape (num_envs,), which have an episode.

        Returns:
            Which of their episodes have ended, shape (num_envs,).

        Raises:
            ClosedEnvironmentError: The environments are closed.
            InvalidAction: The actions have the wrong shape, are NaN, or no real numbers.
        """
        self._stage.check_open()
        numbers = self._episodes.read_actions(actions, self.num_envs)
        acting = None if rows.all() else np.flatnonzero(rows)
        self._episodes.step(numbers, acting, acting)
        _, terminated, truncated = self._episodes.judge()
        ended: BoolArray = (terminated | truncated) & rows
        self._has_begun &= ~ended
        self._stage.show()
        return ended

    def observations_of(self, rows: BoolArray) -> Any:
        """Returns the last observations of some environments; those of others repeat the first one.

        Args:
            rows: The environments, at least one, shape (num_envs,).
        """
        if rows.all():
            return self._present()
        repeated = np.where(rows, np.arange(self.num_envs), rows.argmax())
        return self._episodes.layout.present(self._episodes.observations[repeated])

    def _begin(self, rows: Rows, places: Sequence[Mapping[str, Any]] = ()) -> None:
        """Begins episodes.

        Args:
            rows: The environments.
            places: Options of all environments, see `Episodes.begin`.

        Raises:
            WorldError: See `reset`.
        """
        for row in rows.tolist():
            self._has_begun[row] = False
            rng = self._rng(row)
            self._stage.restore(row, rng)
            try:
                self._episodes.begin(row, rng, Occupied(), places[row] if places else {})
            except WorldError as error:
                raise WorldError(f"environment {row}: {error.message}") from error
            self._has_begun[row], self._has_ended[row] = True, False

    def _finish(self, ended: BoolArray) -> dict[str, Any]:
        """Begins the next episodes, and returns the results of the previous ones."""
        rows = np.flatnonzero(ended)
        observations = np.full(self.num_envs, None, dtype=object)
        for row in rows.tolist():
            observations[row] = self._episodes.layout.present(self._episodes.observations[row])
        infos = {
            "final_obs": observations,
            "_final_obs": ended.copy(),
            "final_info": masked_infos(self._episodes, ended),
            "_final_info": ended.copy(),
        }
        self._begin(rows)
        self._episodes.look(rows)
        return infos

    def _present(self) -> Any:
        return self._episodes.layout.present(self._episodes.observations, copy=self.copy)


def _checked_options(
    options: Mapping[str, Any] | None, n: int
) -> tuple[BoolArray, list[dict[str, DoubleArray]]]:
    """Returns the mask of environments to reset, and the options of each environment.

    Raises:
        TypeError: A mask is not an array of bools.
        ValueError: An option is unknown, or has the wrong shape.
    """
    known = ("goal", "goal_mask", "reset_mask", "start", "start_mask")
    options = checked_options(options, known)
    reset = checked_mask("reset_mask", options.get("reset_mask"), n)
    if not reset.any():
        raise ValueError('options["reset_mask"] must contain True')
    places: list[dict[str, DoubleArray]] = [{} for _ in range(n)]
    for name, size in (("start", 3), ("goal", 2)):
        mask = checked_mask(f"{name}_mask", options.get(f"{name}_mask"), n)
        if name not in options:
            if f"{name}_mask" in options:
                raise ValueError(f'options["{name}_mask"] requires options["{name}"]')
            continue
        values = np.asarray(options[name])
        if values.shape not in ((size,), (n, size)) or values.dtype.kind not in "fiu":
            raise ValueError(
                f'options["{name}"] must be numbers of the shape ({size},) or ({n}, {size}), got '
                f"{shown(options[name])}"
            )
        for row in np.flatnonzero(mask).tolist():
            places[row][name] = values if values.ndim == 1 else values[row]
    return reset, places


def masked_infos(episodes: Episodes, mask: BoolArray | None = None) -> dict[str, Any]:
    """Returns the infos of some environments as arrays with masks.

    Args:
        episodes: The episodes of all environments.
        mask: The environments, shape (n,); None for all.
    """
    chosen = np.ones(len(episodes.agents), np.bool_) if mask is None else mask
    infos: dict[str, Any] = {}
    for name, values in episodes.infos().items():
        if mask is None:
            infos[name] = values.copy()
        else:
            infos[name] = np.where(mask, values, np.zeros(1, values.dtype))
        infos[f"_{name}"] = chosen.copy()
    return infos


def checked_mask(name: str, mask: object, n: int) -> BoolArray:
    """Returns a mask of n environments, all of them for None.

    Raises:
        TypeError: It is not an array of bools.
        ValueError: It has another shape.
    """
    if mask is None:
        return np.ones(n, np.bool_)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f'options["{name}"] must be an array of bools, got {shown(mask)}')
    if mask.shape != (n,):
        raise ValueError(f'options["{name}"] must have the shape ({n},), got {mask.shape}')
    return mask


def checked_seeds(seed: int | Sequence[int | None] | None, n: int) -> list[int | None]:
    """Returns the seeds of n environments.

    Args:
        seed: Seed of the first one, or a list of all seeds.
        n: Number of environments.

    Raises:
        ValueError: There is another number of seeds, or a seed is no integer of at least 0.
    """
    if seed is None:
        return [None] * n
    if isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str | bytes):
        seeds = list(seed)
        if len(seeds) != n:
            raise ValueError(
                f"there must be a seed for each of the {n} environments, got {len(seeds)}"
            )
        return [None if each is None else checked_count("each seed", each, 0) for each in seeds]
    first = checked_count("seed", seed, 0)
    return [first + i for i in range(n)]
