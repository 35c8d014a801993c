"""Registered names, images, and messages when an extra is missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

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


def test_max_steps_is_the_same_limit(make: Make) -> None:
    name = "flatland/Corridor-v0"
    env = make(gymnasium.make, name, max_steps=500)
    assert env.spec.max_episode_steps == env.get_wrapper_attr("_max_episode_steps") == 500
    assert gymnasium.spec(name).max_episode_steps == 200
    assert make(gymnasium.make, name).spec.max_episode_steps == 200
    again = make(gymnasium.make, env.spec)
    assert again.spec.max_episode_steps == again.unwrapped.episodes.settings.max_steps == 500
    lower = make(gymnasium.make, name, max_steps=2, max_episode_steps=3)
    lower.reset(seed=1)
    assert [lower.step(np.array([-1, 0]))[3] for _ in range(2)] == [False, True]
    sync = make(gymnasium.make_vec, name, 1, vectorization_mode="sync", max_steps=500)
    assert sync.envs[0].spec.max_episode_steps == 500


@pytest.mark.parametrize("create", [flatland.gym.make_vec, gymnasium.make_vec])
@pytest.mark.parametrize("name", ["flatland/Corridor-v0", "flatland/Fleet-v0"])
def test_max_steps_is_the_same_limit_of_a_vector(make: Make, create: Any, name: str) -> None:
    for arguments, limit in (
        ({"max_steps": 500}, 500),
        ({"max_steps": 7}, 7),
        ({"max_episode_steps": 500}, 500),
        ({"max_steps": 500, "max_episode_steps": 70}, 70),
        ({"max_steps": 70, "max_episode_steps": 500}, 70),
    ):
        envs = make(create, name, 1, num_threads=1, **arguments)
        assert envs.episodes.settings.max_steps == limit


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_autoreset_modes_have_names(make: Make, mode: AutoresetMode) -> None:
    for given in (mode, mode.name, mode.value):
        envs = make(flatland.gym.make_vec, "flatland/Corridor-v0", 1, autoreset_mode=given)
        assert envs.metadata["autoreset_mode"] is envs.autoreset_mode is mode
    for given in ("same_step", None, 5):
        with pytest.raises(ValueError, match="autoreset_mode must be one of NEXT_STEP, SAME_STEP"):
            flatland.gym.make_vec("flatland/Corridor-v0", 1, autoreset_mode=given)


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
