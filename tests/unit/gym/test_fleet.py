"""Several robots in one world, with the API of PettingZoo."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from pettingzoo.test import parallel_api_test

from flatland.gym import make_parallel

Make = Callable[..., Any]


@pytest.mark.parametrize("num_robots", [1, 4])
def test_the_checker_of_pettingzoo_finds_nothing(make: Make, num_robots: int) -> None:
    parallel_api_test(make(make_parallel, num_robots=num_robots), 50)


def test_robots_and_goals_keep_a_distance(make: Make) -> None:
    env = make(make_parallel, num_robots=16)
    for seed in range(5):
        env.reset(seed=seed)
        states = env.state().reshape(16, 8)
        for places in (states[:, :2], states[:, 6:]):
            gaps = np.hypot(*(places[:, np.newaxis] - places).transpose(2, 0, 1))
            assert (gaps + 9 * np.eye(16)).min() >= 0.4 + 0.15 - 1e-4
        assert env.world.contacts == []


def test_robots_see_each_other(make: Make) -> None:
    env = make(make_parallel, num_robots=2)
    env.reset(seed=0)
    env.world.move_model("robot_0", (6, 6, 0))
    env.world.move_model("robot_1", (7, 6, 0))
    observations, *_ = env.step({name: np.array([-1, 0]) for name in env.agents})
    ahead = observations["robot_0"][90] * 6
    assert ahead == pytest.approx(0.8, abs=0.02)


def test_a_robot_whose_episode_has_ended_stops_and_remains(make: Make) -> None:
    env = make(make_parallel, num_robots=2)
    env.reset(seed=0)
    env.world.move_model("robot_0", (1, 6, np.pi))
    for _ in range(20):
        _, rewards, terminated, truncated, infos = env.step(
            {name: np.array([1.0 if name == "robot_0" else -1.0, 0.0]) for name in env.agents}
        )
        if env.agents == ["robot_1"]:
            break
    assert terminated == {"robot_0": True, "robot_1": False}
    assert truncated == {"robot_0": False, "robot_1": False}
    assert infos["robot_0"]["collision"]
    assert rewards["robot_0"] < -4
    results = env.step({"robot_1": np.array([-1.0, 0.0])})
    assert [list(each) for each in results] == [["robot_1"]] * 5
    env.step({"robot_1": np.array([-1.0, 0.0])})
    pose = env.world.model("robot_0").pose
    env.step({"robot_1": np.array([-1.0, 0.0])})
    assert env.world.model("robot_0").pose == pytest.approx(pose, abs=1e-3)


def test_invalid_actions_are_errors(make: Make) -> None:
    env = make(make_parallel, num_robots=2)
    with pytest.raises(ResetNeeded):
        env.step({})
    env.reset(seed=0)
    still = np.zeros(2)
    for actions, message in (
        ({"robot_0": still}, "robot_0, robot_1, got robot_0"),
        ({"robot_0": still, "robot_1": still, "robot_2": still}, "got robot_0, robot_1, robot_2"),
        ({"robot_0": still, "robot_1": np.full(2, np.nan)}, "NaN"),
        ({"robot_0": still, "robot_1": np.zeros(3)}, "numbers of shape|have the shape"),
    ):
        with pytest.raises(InvalidAction, match=message):
            env.step(actions)
    env.step({"robot_0": still, "robot_1": still})


@pytest.mark.parametrize("arguments", [{"num_robots": 0}, {"render_mode": "ansi"}])
def test_an_invalid_argument_is_an_error(arguments: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(arguments))):
        make_parallel(**arguments)
    with pytest.raises(TypeError, match="agent"):
        make_parallel(agent="robot_1")
