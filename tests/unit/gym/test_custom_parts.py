"""Rewards, endings and tasks of users, and clear errors for what they return."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from flatland.gym import (
    Arrived,
    Ending,
    FlatlandEnv,
    FlatlandVectorEnv,
    FleetVectorEnv,
    Progress,
    RandomGoal,
    Reward,
    Situation,
    Step,
    Task,
)

Make = Callable[..., Any]

AHEAD = np.array([1.0, 0.0], np.float32)


def closer(situation: Situation) -> Any:
    return situation.previous_distance - situation.distance


def reward_of(make: Make, reward: Any, **arguments: Any) -> float:
    env = make(FlatlandEnv, "corridor", reward=reward, **arguments)
    env.reset(seed=1)
    return float(env.step(AHEAD)[1])


def test_a_function_is_a_reward(make: Make) -> None:
    expected = reward_of(make, Progress())
    assert reward_of(make, closer) == expected != 0
    assert reward_of(make, lambda s: 2 * closer(s)) == 2 * expected
    combined = 3.0 * (Progress() + closer) + (lambda s: np.ones(len(s)))
    assert reward_of(make, combined) == pytest.approx(6 * expected + 1)
    assert reward_of(make, closer + Step()) == pytest.approx(expected + 1)  # type: ignore[operator]
    assert reward_of(make, lambda s: s.collided) == 0  # bools


def test_a_function_is_an_ending(make: Make) -> None:
    for ending in (
        lambda s: s.steps >= 2,
        Arrived() | (lambda s: s.steps >= 2),
        (lambda s: s.steps >= 2) | Arrived(),
    ):
        env = make(FlatlandEnv, "corridor", ending=ending)
        env.reset(seed=1)
        assert [env.step(AHEAD)[2] for _ in range(2)] == [False, True]


def test_what_a_function_returns_is_not_changed(make: Make) -> None:
    envs = make(
        FlatlandVectorEnv, 2, "corridor", reward=lambda s: s.distance, ending=lambda s: s.steps >= 1
    )
    envs.reset(seed=1)
    for _ in range(3):  # Rewards of environments that begin are set to 0.
        _, rewards, _, _, infos = envs.step(np.array([AHEAD, AHEAD]))
    assert (infos["distance"] > 0).all()
    assert rewards.dtype == np.float64


class Named(Reward):
    def compute(self, situation: Situation) -> Any:
        return np.full(len(situation), np.inf)


class Odd(Ending):
    def check(self, situation: Situation) -> Any:
        return situation.distance


@pytest.mark.parametrize(
    ("reward", "error", "text"),
    [
        (lambda _: np.ones(3), ValueError, r"the reward .*lambda.* the shape \(2,\), got \(3,\)"),
        (lambda _: 1.0, ValueError, r"the reward .* the shape \(2,\), got \(\)"),
        (lambda s: s.poses, ValueError, r"the reward .* the shape \(2,\), got \(2, 3\)"),
        (lambda _: np.array([0.0, np.nan]), ValueError, "finite numbers, got nan for agent 1"),
        (lambda _: ["a", "b"], TypeError, r"finite numbers of the shape \(2,\), got \['a', 'b'\]"),
        (lambda _: None, TypeError, r"finite numbers of the shape \(2,\), got None"),
        (Named(), ValueError, "the reward Named must return finite numbers, got inf for agent 0"),
        (Progress() + Named(), ValueError, "the reward Named must return finite numbers"),
        (2.0 * Named(), ValueError, "the reward Named must return finite numbers"),
    ],
)
def test_an_invalid_reward_names_the_part_and_the_shape(
    make: Make, reward: Any, error: type[Exception], text: str
) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor", reward=reward)
    envs.reset(seed=1)
    with pytest.raises(error, match=text):
        envs.step(np.array([AHEAD, AHEAD]))


@pytest.mark.parametrize(
    ("ending", "error", "text"),
    [
        (
            lambda _: np.zeros(3, bool),
            ValueError,
            r"the ending .*lambda.* shape \(4,\), got \(3,\)",
        ),
        (lambda _: False, ValueError, r"the ending .* the shape \(4,\), got \(\)"),
        (Odd(), TypeError, r"the ending Odd must return bools of the shape \(4,\), got array"),
        (Arrived() | Odd(), TypeError, "the ending Odd must return bools"),
    ],
)
def test_an_invalid_ending_names_the_part_and_the_shape(
    make: Make, ending: Any, error: type[Exception], text: str
) -> None:
    envs = make(FleetVectorEnv, 1, ending=ending)
    envs.reset(seed=1)
    with pytest.raises(error, match=text):
        envs.step(np.array([AHEAD] * 4))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"reward": Progress}, "reward must be a Reward or a function of a Situation, got <class"),
        ({"reward": 5}, "reward must be a Reward or a function of a Situation, got 5"),
        ({"ending": Arrived}, "ending must be an Ending or a function of a Situation, got <class"),
        ({"ending": None}, "ending must be an Ending or a function of a Situation, got None"),
        ({"task": RandomGoal}, "task must be a Task, got <class"),
    ],
)
def test_a_class_is_no_part(arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(TypeError, match=text):
        FlatlandEnv("corridor", **arguments)
    with pytest.raises(TypeError, match="each term of a reward must be a Reward or a function"):
        Progress() + 5  # type: ignore[operator]
    with pytest.raises(TypeError, match="each ending must be an Ending or a function"):
        Arrived() | 5  # type: ignore[operator]


class Drawn(Task):
    """Returns what the class attribute says."""

    result: Any = ((1.0, 1.25, 0.0), (8.0, 1.25))

    def draw(self, agent: Any, rng: Any, occupied: Any) -> Any:
        return self.result


def test_a_task_of_a_user(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make(FlatlandEnv, "corridor", task=Drawn())
    env.reset(seed=1)
    assert env.goal == (8.0, 1.25)
    for result in (
        None,
        (1, 2),
        ((1, 2, 0), (1,)),
        ((1, 2, "0"), (1, 2)),
        ((1, 2, 0), (np.nan, 1)),
    ):
        monkeypatch.setattr(Drawn, "result", result)
        with pytest.raises(TypeError, match=r"Drawn\.draw must return a start .* and a goal"):
            env.reset(seed=1)
    monkeypatch.setattr(Drawn, "goal_radius", "3")
    with pytest.raises(ValueError, match="goal_radius of Drawn must be a number"):
        env.task = Drawn()
