"""Registered names, images, and messages when an extra is missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import flatland.gym
from flatland.gym import FlatlandEnv, FlatlandVectorEnv, FleetVectorEnv

Make = Callable[..., Any]


def test_names_are_registered_with_gymnasium(make: Make) -> None:
    for module, name, limit in (
        ("", "flatland/Navigate-v0", 300),
        ("flatland.gym:", "flatland/Corridor-v0", 200),
    ):
        env = make(gymnasium.make, f"{module}{name}")
        assert isinstance(env.unwrapped, FlatlandEnv)
        assert (env.spec.id, env.spec.max_episode_steps) == (name, limit)


@pytest.mark.parametrize("create", [flatland.gym.make_vec, gymnasium.make_vec])
def test_vectors_are_made_by_name(make: Make, create: Any) -> None:
    for name, kind, arguments, count, limit in (
        ("flatland/Corridor-v0", FlatlandVectorEnv, {"autoreset_mode": "SameStep"}, 2, 200),
        ("flatland/Fleet-v0", FleetVectorEnv, {"num_robots": 3}, 6, 300),
    ):
        envs = make(create, name, num_envs=2, num_threads=1, **arguments)
        assert isinstance(envs, kind)
        assert (envs.num_envs, envs.spec.id) == (count, name)
        assert envs.episodes.settings.max_steps == limit


@pytest.mark.parametrize("limit", [3, 305])
def test_the_limit_of_gymnasium_replaces_that_of_the_environment(make: Make, limit: int) -> None:
    env = make(gymnasium.make, "flatland/Corridor-v0", max_episode_steps=limit)
    vector = make(gymnasium.make_vec, "flatland/Corridor-v0", 2, max_episode_steps=limit)
    own = make(flatland.gym.make_vec, "flatland/Corridor-v0", max_steps=limit)
    env.reset(seed=0)
    vector.reset(seed=0)
    own.reset(seed=0)
    for step in range(limit):
        truncated = [
            env.step(np.array([-1, 0], np.float32))[3],
            *vector.step(np.array([[-1, 0]] * 2))[3],
            *own.step(np.array([[-1, 0]]))[3],
        ]
        assert truncated == [step == limit - 1] * 4


def test_names_of_other_kinds_are_errors() -> None:
    with pytest.raises(gymnasium.error.NameNotFound, match=r"Navigate-v0, .*Maze-v0"):
        flatland.gym.make_vec("flatland/Nowhere-v0")
    with pytest.raises(gymnasium.error.NameNotFound, match="Fleet-v0"):
        flatland.gym.make_parallel("flatland/Navigate-v0")
    with pytest.raises(gymnasium.error.UnsupportedMode, match=r"make_parallel\("):
        gymnasium.make("flatland/Fleet-v0")


def test_the_included_worlds_are_found_by_name(checkout: Path) -> None:
    assert flatland.gym.find_world("navigate").parent.name == "learning"
    path = checkout / "worlds" / "simple" / "world.yaml"
    assert flatland.gym.find_world(path) == path
