"""Environments that are copied and pickled."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from nested import assert_same

from flatland.gym import Arrived, FlatlandEnv, FlatlandVectorEnv, RandomBuildings, make_parallel
from flatland.gym.fleet import FleetEnv

Make = Callable[..., Any]

AHEAD = np.array([1.0, 0.1], np.float32)
COPIES = [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))]


def episode(env: Any, seed: int | None) -> list[Any]:
    """Returns the results of an environment of any kind, in which robots slide along walls."""
    results = [env.reset(seed=seed)]
    for _ in range(30):
        if isinstance(env, FleetEnv):
            action: Any = dict.fromkeys(env.agents, AHEAD)
        else:
            action = np.broadcast_to(AHEAD, env.action_space.shape)
        results.append(env.step(action))
    return results


@pytest.mark.parametrize("duplicate", COPIES, ids=["deepcopy", "pickle"])
@pytest.mark.parametrize(
    "create",
    [
        lambda: FlatlandEnv(RandomBuildings("office", 2, size=(14, 12)), ending=Arrived()),
        lambda: gymnasium.make("flatland/Corridor-v0", ending=Arrived()),
        lambda: FlatlandVectorEnv(2, world="corridor", max_steps=20, ending=Arrived()),
        lambda: make_parallel(num_robots=3, ending=Arrived()),
    ],
    ids=["single", "by name", "vector", "fleet"],
)
def test_a_copy_continues_with_the_next_episode(
    make: Make, create: Callable[[], Any], duplicate: Callable[[Any], Any]
) -> None:
    env = make(create)
    first = episode(env, 3)
    # Without the past of the original, which does not matter.
    other = make(lambda: duplicate(env))
    with pytest.raises(ResetNeeded):
        other.unwrapped.step({})
    following = episode(env, None)
    assert_same(episode(other, None), following)
    assert_same(episode(other, 3), first)
    assert_same(episode(env, 3), first)
    with pytest.raises(AssertionError):
        assert_same(following, first)
    if not isinstance(env, FleetEnv):
        assert getattr(other.spec, "id", None) == getattr(env.spec, "id", None)
        assert other.unwrapped.np_random_seed == env.unwrapped.np_random_seed
