"""Rates of success of a policy or a controller, on episodes that depend on their seeds only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import AutoresetMode

from flatland.checks import checked_count
from flatland.geometry import BoolArray

if TYPE_CHECKING:
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
        envs: Environments of the autoreset mode `SAME_STEP`.
        episodes: Number of episodes, of any number of environments.
        seed: Seed of the first episode.

    Raises:
        ValueError: The environments have another mode, or there is no episode.
    """
    if envs.autoreset_mode is not AutoresetMode.SAME_STEP:
        raise ValueError(f"the autoreset mode must be SAME_STEP, got {envs.autoreset_mode}")
    episodes, n = checked_count("episodes", episodes), envs.num_envs
    reset: Callable[[BoolArray], object] = getattr(choose, "reset", lambda _: None)
    observations, _ = envs.reset(seed=seed)
    reset(np.ones(n, np.bool_))
    numbers = np.arange(n)  # of the episodes in the environments
    lengths = np.zeros(n, np.int64)
    results = np.zeros((episodes, 3), np.int64)
    while (numbers < episodes).any():
        observations, _, terminated, truncated, infos = envs.step(choose(observations))
        lengths += 1
        ended = terminated | truncated
        if not ended.any():
            continue
        counted = ended & (numbers < episodes)
        final = infos["final_info"]
        columns = final["is_success"], final["collision"], lengths
        results[numbers[counted]] = np.stack([column[counted] for column in columns], axis=1)
        numbers[ended] = numbers.max() + 1 + np.arange(np.count_nonzero(ended))
        lengths[ended] = 0
        # Environments without a further episode continue until the others end.
        begun = ended & (numbers < episodes)
        if begun.any():
            seeds = [seed + number for number in numbers.tolist()]
            observations, _ = envs.reset(seed=seeds, options={"reset_mask": begun})
        reset(ended)
    success, collision, steps = results.T
    return Outcomes(success.astype(np.bool_), collision.astype(np.bool_), steps)
