"""What the programs of this folder have in common: the environment that is learned."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flatland.gym import (
    FlatlandEnv,
    FlatlandVectorEnv,
    Goal,
    Observation,
    Proximity,
    Scan,
    Velocity,
    make_vec,
    navigation_reward,
)

NAME = "flatland/Navigate-v0"
STEP = 0.1  # s, duration of a step of the environment
EVALUATION_SEED = 1_000_000  # of the first episode; not used in training


def arguments(**changes: Any) -> dict[str, Any]:
    """Returns the arguments of the environment.

    The 180 beams are combined into 36 sectors, so that a small network suffices. A small penalty
    for short distances to obstacles teaches the robot to keep away before it collides.
    """
    return {
        "observation": Observation(Scan(36, half=0.5), Goal(), Velocity()),
        "reward": navigation_reward() + -0.1 * Proximity(0.5),
        **changes,
    }


def make_many(num_envs: int, **changes: Any) -> FlatlandVectorEnv:
    """Returns environments for training; the next episode begins in the step that ends one."""
    return make_vec(NAME, num_envs, autoreset_mode="SameStep", **arguments(**changes))


def make_one(**changes: Any) -> FlatlandEnv:
    """Returns one environment of the same kind."""
    return FlatlandEnv(**arguments(**changes))


def actions_of(model: Any) -> Callable[[Any], Any]:
    """Returns the function from observations to the most probable actions of a policy."""
    return lambda observations: model.predict(observations, deterministic=True)[0]
