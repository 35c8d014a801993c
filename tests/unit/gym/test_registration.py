"""Registered names, images, and messages when an extra is missing."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import flatland.gym
from flatland.gym import FlatlandEnv, FlatlandVectorEnv

Make = Callable[..., Any]

# Imports a module in a Python that lacks another one.
WITHOUT = """
import importlib.abc, importlib.util, sys
hidden = sys.argv[1]
find_spec = importlib.util.find_spec
class Hide(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == hidden or name.startswith(hidden + "."):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hide())
importlib.util.find_spec = lambda name, package=None: None if name == hidden else find_spec(name)
try:
    import flatland.gym
    flatland.gym.make_parallel()
except ImportError as error:
    print(error)
"""


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


def test_gymnasium_imports_the_package_by_name() -> None:
    program = "import gymnasium; gymnasium.make('flatland.gym:flatland/Corridor-v0').close()"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_vectors_are_made_by_name(make: Make) -> None:
    envs = make(flatland.gym.make_vec, "flatland/Corridor-v0", num_envs=2, num_threads=1)
    assert isinstance(envs, FlatlandVectorEnv)
    with pytest.raises(gymnasium.error.NameNotFound, match=r"Navigate-v0, flatland/Corridor-v0"):
        flatland.gym.make_vec("flatland/Nowhere-v0")
    with pytest.raises(gymnasium.error.NameNotFound, match="Fleet-v0"):
        flatland.gym.make_parallel("flatland/Navigate-v0")


def test_the_fleet_is_no_environment_of_gymnasium() -> None:
    for make in (gymnasium.make, flatland.gym.make_vec):
        with pytest.raises(gymnasium.error.UnsupportedMode, match=r"make_parallel\("):
            make("flatland/Fleet-v0")


@pytest.mark.parametrize(
    ("module", "message"),
    [
        ("gymnasium", "flatland.gym requires Gymnasium"),
        ("pettingzoo", "environments with several robots require PettingZoo"),
    ],
)
def test_a_missing_extra_is_named_with_the_command(module: str, message: str) -> None:
    output = subprocess.run(
        [sys.executable, "-c", WITHOUT, module], check=True, capture_output=True, text=True
    ).stdout
    assert output == f'{message}, which is not installed: pip install "flatland-sim[gym]"\n'


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
