"""Environments that are copied, pickled, and sent to other processes."""

from __future__ import annotations

import copy
import pickle
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from programs import run_program

from flatland.gym import FlatlandEnv, FlatlandVectorEnv, make_parallel

Make = Callable[..., Any]

COPIES = [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))]


def episode(env: Any, seed: int | None) -> list[bytes]:
    """Returns the observations of some steps of a single environment or a vector."""
    observations = [env.reset(seed=seed)[0]]
    shape = env.action_space.shape
    for _ in range(5):
        observations.append(env.step(np.full(shape, 0.3, np.float32))[0])
    return [each.tobytes() for each in observations]


@pytest.mark.parametrize("duplicate", COPIES, ids=["deepcopy", "pickle"])
@pytest.mark.parametrize(
    "create",
    [
        lambda: FlatlandEnv("corridor", max_steps=7),
        lambda: gymnasium.make("flatland/Corridor-v0", max_episode_steps=7),
        lambda: FlatlandVectorEnv(2, world="corridor", max_steps=7),
    ],
    ids=["single", "by name", "vector"],
)
def test_a_copy_continues_with_the_next_episode(
    make: Make, create: Callable[[], Any], duplicate: Callable[[Any], Any]
) -> None:
    env = make(create)
    episode(env, 3)
    other = make(lambda: duplicate(env))
    assert other.spec == env.spec
    with pytest.raises(ResetNeeded):
        other.unwrapped.step(np.zeros(other.action_space.shape, np.float32))
    expected = [episode(env, None), episode(env, 5)]
    assert [episode(other, None), episode(other, 5)] == expected
    assert other.unwrapped.np_random_seed == env.unwrapped.np_random_seed


def test_a_copy_of_a_fleet_continues_with_the_next_episode(make: Make) -> None:
    env = make(make_parallel, num_robots=2, max_steps=9)
    first = env.reset(seed=1)[0]["robot_1"].tobytes()
    copies = [make(duplicate, env) for duplicate in COPIES]
    following = env.reset()[0]["robot_1"].tobytes()
    assert following != first
    assert [other.reset()[0]["robot_1"].tobytes() for other in copies] == [following] * 2


def test_an_environment_survives_a_new_process(make: Make, tmp_path: Path) -> None:
    env = make(FlatlandVectorEnv, 2, world="corridor")
    file = tmp_path / "env.pickle"
    file.write_bytes(pickle.dumps(env))
    program = (
        "import pathlib, pickle, sys\n"
        "env = pickle.loads(pathlib.Path(sys.argv[1]).read_bytes())\n"
        "print(env.reset(seed=3)[0].tobytes().hex())\n"
        "env.close()"
    )
    done = run_program([sys.executable, "-c", program, str(file)], check=True)
    assert bytes.fromhex(done.stdout) == env.reset(seed=3)[0].tobytes()
