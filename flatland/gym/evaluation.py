"""Rates of success of a policy or a controller, on episodes that depend on their seeds only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from flatland.checks import check_function, check_kind, checked_count
from flatland.geometry import BoolArray
from flatland.gym.policies import Policy
from flatland.gym.vector import FlatlandVectorEnv


@dataclass(frozen=True, slots=True, eq=False)
class Outcomes:
    """How episodes ended; element i of each array is that of the seed `seed + i`.

    Attributes:
        is_success: Whether the robot arrived, shape (n,).
        collision: Whether the robot touched something in the last step, shape (n,).
        steps: Number of steps, shape (n,).
    """

    is_success: BoolArray
    collision: BoolArray
    steps: np.typing.NDArray[np.int64]

    @property
    def success_rate(self) -> float:
        """Share of episodes in which the robot arrived."""
        return float(self.is_success.mean())

    @property
    def collision_rate(self) -> float:
        """Share of episodes that ended with a contact."""
        return float(self.collision.mean())

    @property
    def rest_rate(self) -> float:
        """Share of other episodes, such as those that reached their limit of steps."""
        return float((~self.is_success & ~self.collision).mean())

    @property
    def mean_steps(self) -> float:
        """Mean number of steps of the episodes in which the robot arrived; NaN without any."""
        return float(self.steps[self.is_success].mean()) if self.is_success.any() else np.nan


def evaluate(
    choose: Callable[[Any], Any], envs: FlatlandVectorEnv, episodes: int, seed: int = 0
) -> Outcomes:
    """Runs episodes with successive seeds, each from its reset with the seed to its end.

    Two calls with equal tasks, worlds and seeds have the same starts and goals.

    Args:
        choose: Returns the actions for the observations of all environments, such as a
            `Controller` or a `Policy`. If it has a method `reset`, that is called at the start of
            episodes, with an array of bools of shape (num_envs,) that selects them.
        envs: Environments of the autoreset mode `SAME_STEP`. Afterwards, they must be reset.
        episodes: Number of episodes, of any number of environments; no others begin.
        seed: Seed of the first episode.

    Raises:
        TypeError: `choose` is no function, or `envs` are other environments.
        ValueError: The environments have another mode, or there is no episode.
        PolicyError: The policy was trained with another duration of an action.
    """
    check_function("choose", choose)
    check_kind("envs", envs, FlatlandVectorEnv, "a FlatlandVectorEnv")
    if envs.autoreset_mode is not AutoresetMode.SAME_STEP:
        raise ValueError(f"the autoreset mode must be SAME_STEP, got {envs.autoreset_mode}")
    if isinstance(choose, Policy):
        choose.check_period(envs.episodes.settings.dt)
    episodes, n = checked_count("episodes", episodes), envs.num_envs
    seed = checked_count("seed", seed, 0)
    reset: Callable[[BoolArray], object] = getattr(choose, "reset", lambda _: None)
    numbers = np.arange(n)  # of the episodes in the environments
    lengths = np.zeros(n, np.int64)
    results = np.zeros((episodes, 3), np.int64)
    begun = numbers < episodes
    envs.reset(seed=seed, options={"reset_mask": begun})
    reset(np.ones(n, np.bool_))
    running = begun.copy()
    while running.any():
        # Environments without an episode repeat an action that has no effect on them.
        actions = np.array(choose(envs.observations_of(running)))
        if actions.ndim and len(actions) == n:
            actions[~running] = actions[running.argmax()]
        ended = envs.step_rows(actions, running)
        lengths += running
        if not ended.any():
            continue
        final = envs.episodes.infos()
        columns = final["is_success"], final["collision"], lengths
        results[numbers[ended]] = np.stack([column[ended] for column in columns], axis=1)
        numbers[ended] = numbers.max() + 1 + np.arange(np.count_nonzero(ended))
        lengths[ended] = 0
        begun = ended & (numbers < episodes)
        if begun.any():
            seeds = [seed + number for number in numbers.tolist()]
            envs.reset(seed=seeds, options={"reset_mask": begun})
        running = (running & ~ended) | begun
        reset(ended)
    success, collision, steps = results.T
    return Outcomes(success.astype(np.bool_), collision.astype(np.bool_), steps)
