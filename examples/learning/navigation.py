"""What the programs of this folder have in common: the environment that is learned."""

from __future__ import annotations

from typing import Any

from flatland.gym import (
    FlatlandEnv,
    FlatlandVectorEnv,
    Goal,
    Observation,
    Scan,
    Velocity,
    make_vec,
)

NAME = "flatland/Navigate-v0"
STEP = 0.1  # s, duration of a step of the environment
EVALUATION_SEED = 1_000_000  # of the first episode; not used in training


def arguments(**changes: Any) -> dict[str, Any]:
    """Returns the arguments of the environment: 36 sectors of the scan instead of 180 beams."""
    return {"observation": Observation(Scan(36), Goal(), Velocity()), **changes}


def make_many(num_envs: int, **changes: Any) -> FlatlandVectorEnv:
    """Returns environments for training, in which an episode follows the other at once."""
    return make_vec(NAME, num_envs, autoreset_mode="SameStep", **arguments(**changes))


def make_one(**changes: Any) -> FlatlandEnv:
    """Returns one environment of the same kind."""
    return FlatlandEnv(**arguments(**changes))
