"""Registered names, images, and messages when an extra is missing."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from programs import run_program

import flatland.gym
from flatland.gym import FlatlandEnv, FlatlandVectorEnv, FleetVectorEnv

Make = Callable[..., Any]


def test_names_are_registered_with_gymnasium(make: Make) -> None:
    for name in ("flatland/Navigate-v0", "flatland/Corridor-v0"):
        env = make(gymnasium.make, name, max_steps=7)
        assert isinstance(env.unwrapped, FlatlandEnv)
        assert env.spec.id == name
    envs = make(
        gymnasium.make_vec,
        "flatland/Corridor-v0",
        num_envs=3,
        vectorization_mode="vector_entry_point",
        autoreset_mode="SameStep",
    )
    assert isinstance(envs, FlatlandVectorEnv)
    assert envs.num_envs == 3
    assert envs.spec.id == "flatland/Corridor-v0"


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


def test_the_registered_limit_is_that_of_gymnasium(make: Make) -> None:
    assert make(gymnasium.make, "flatland/Corridor-v0").spec.max_episode_steps == 200
    assert make(gymnasium.make, "flatland/Navigate-v0").spec.max_episode_steps == 300
    vector = make(flatland.gym.make_vec, "flatland/Corridor-v0")
    vector.reset(seed=0)
    truncated = [vector.step(np.array([[-1.0, 0.0]]))[3][0] for _ in range(200)]
    assert truncated.index(True) == 199


def test_gymnasium_imports_the_package_by_name() -> None:
    program = "import gymnasium; gymnasium.make('flatland.gym:flatland/Corridor-v0').close()"
    run_program([sys.executable, "-c", program], check=True)


def test_vectors_are_made_by_name(make: Make) -> None:
    envs = make(flatland.gym.make_vec, "flatland/Corridor-v0", num_envs=2, num_threads=1)
    assert isinstance(envs, FlatlandVectorEnv)
    with pytest.raises(gymnasium.error.NameNotFound, match=r"Navigate-v0, .*Maze-v0"):
        flatland.gym.make_vec("flatland/Nowhere-v0")
    with pytest.raises(gymnasium.error.NameNotFound, match="Fleet-v0"):
        flatland.gym.make_parallel("flatland/Navigate-v0")


def test_the_fleet_is_no_single_environment_of_gymnasium() -> None:
    with pytest.raises(gymnasium.error.UnsupportedMode, match=r"make_parallel\("):
        gymnasium.make("flatland/Fleet-v0")


def test_vectors_of_fleets_are_made_by_name(make: Make) -> None:
    for create in (flatland.gym.make_vec, gymnasium.make_vec):
        envs = make(create, "flatland/Fleet-v0", num_envs=2, num_robots=3)
        assert isinstance(envs, FleetVectorEnv)
        assert envs.num_envs == 6
        assert envs.spec.id == "flatland/Fleet-v0"
        assert envs.episodes.settings.max_steps == 300
    envs = make(flatland.gym.make_vec, "flatland/Fleet-v0", max_steps=400)
    assert envs.episodes.settings.max_steps == 400


def test_an_image_shows_the_goal(make: Make) -> None:
    env = make(world="corridor", render_mode="rgb_array")
    images = []
    for goal in ((5.0, 1.0), (8.0, 1.2)):
        env.reset(seed=0, options={"start": (1, 1.25, 0), "goal": goal})
        images.append(env.render())
    assert images[0].shape == (600, 800, 3)
    assert images[0].dtype == np.uint8
    assert (images[0] != images[1]).any()
    assert make(world="corridor").render() is None


def test_the_included_worlds_are_found_by_name(checkout: Path) -> None:
    assert flatland.gym.find_world("navigate").parent.name == "learning"
    path = checkout / "worlds" / "simple" / "world.yaml"
    assert flatland.gym.find_world(path) == path
