"""Controllers without learning, and the evaluation of controllers and policies."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from flatland import worldgen
from flatland.gym import (
    DiscreteAction,
    FixedGoal,
    FlatlandEnv,
    FlatlandVectorEnv,
    Goal,
    Observation,
    Scan,
    Velocity,
    evaluate,
    included_robot,
)
from flatland.gym.controllers import CONTROLLERS, DynamicWindow, Gap, Straight
from flatland.gym.episodes import Episodes

Make = Callable[..., Any]

OBSERVATIONS = [
    Observation(),
    Observation(Velocity(), Scan(36, half=0.5), Goal(20.0)),
    Observation(Scan(), Velocity(), Goal(), as_dict=True),
]


def make_envs(make: Make, count: int, world: Any = "corridor", **arguments: Any) -> Any:
    return make(FlatlandVectorEnv, count, world, autoreset_mode="SameStep", **arguments)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_controller_reaches_a_goal_in_sight(make: Make, name: str) -> None:
    task = FixedGoal((1, 1.9, 0.5), (2.6, 1.7))
    envs = make_envs(make, 1, task=task, observation=OBSERVATIONS[-1])
    outcomes = evaluate(CONTROLLERS[name](envs), envs, 1)
    assert outcomes.is_success.all()
    assert outcomes.steps[0] < 40


@pytest.mark.parametrize("observation", OBSERVATIONS)
@pytest.mark.parametrize("name", CONTROLLERS)
def test_all_but_the_straight_one_drive_around_a_pillar(
    make: Make, name: str, observation: Observation
) -> None:
    # The pillar extends from (3, 0) to (3.6, 1.1); there is room above it.
    task = FixedGoal((2, 1.0, 0), (4.6, 1.2))
    envs = make_envs(make, 1, task=task, observation=observation)
    outcomes = evaluate(CONTROLLERS[name](envs), envs, 1)
    assert outcomes.is_success.all() == (name != "straight")
    assert outcomes.collision.all() == (name == "straight")


def test_actions_do_not_depend_on_other_environments(make: Make) -> None:
    envs = make_envs(make, 4)
    env = make(FlatlandEnv, "corridor")
    for kind in CONTROLLERS.values():
        many, one = kind(envs), kind(env)
        observations, _ = envs.reset(seed=1)
        actions = many(observations)
        assert actions.shape == (4, 2)
        assert actions.dtype == np.float32
        assert np.abs(actions).max() <= 1
        for row in range(4):
            action = one(observations[row])
            assert env.action_space.contains(action)
            np.testing.assert_allclose(action, actions[row], atol=1e-6)


def test_controllers_that_regard_obstacles_touch_less(make: Make, tmp_path: Path) -> None:
    path = worldgen.office(3, (20, 14)).write(tmp_path / "office", robot=included_robot())
    envs = make_envs(make, 4, path)
    rates = {
        name: evaluate(kind(envs), envs, 4, seed=5).collision_rate
        for name, kind in CONTROLLERS.items()
    }
    assert rates["gap"] == 0
    assert rates["window"] == 0
    assert rates["straight"] > 0.1


def test_rates_are_those_of_all_episodes(make: Make) -> None:
    envs = make_envs(make, 3)
    outcomes = evaluate(Gap(envs), envs, 7, seed=2)
    assert len(outcomes.steps) == 7
    rates = outcomes.success_rate + outcomes.collision_rate + outcomes.rest_rate
    assert rates == pytest.approx(1)
    assert outcomes.mean_steps == pytest.approx(outcomes.steps[outcomes.is_success].mean())


def test_an_evaluation_depends_on_the_seeds_only(make: Make) -> None:
    class Turns:
        """Turns the more, the longer an episode lasts; its actions are NaN before a reset."""

        def __init__(self, n: int) -> None:
            self.steps = np.full(n, np.nan)

        def __call__(self, observations: Any) -> Any:
            self.steps += 1
            return np.column_stack((np.ones(len(self.steps)), np.minimum(self.steps / 20, 1)))

        def reset(self, rows: Any) -> None:
            self.steps[rows] = 0

    few, many = (evaluate(Turns(n), make_envs(make, n, max_steps=60), 7, seed=2) for n in (3, 5))
    for name in ("is_success", "collision", "steps"):
        np.testing.assert_array_equal(getattr(few, name), getattr(many, name))


def test_episodes_end_at_the_limit(make: Make) -> None:
    envs = make_envs(make, 2, max_steps=3)
    outcomes = evaluate(lambda _: np.array([[-1.0, 0.0]] * 2), envs, 2)
    assert outcomes.rest_rate == 1
    assert math.isnan(outcomes.mean_steps)
    assert outcomes.steps.tolist() == [3, 3]


def test_an_invalid_argument_is_an_error(make: Make) -> None:
    blind = make_envs(make, 1, observation=Observation(Goal()))
    with pytest.raises(ValueError, match="must contain Scan"):
        Straight(blind)
    still = make_envs(make, 1, observation=Observation(Scan(), Goal()))
    with pytest.raises(ValueError, match="must contain Velocity"):
        DynamicWindow(still)
    Gap(still)
    for arguments in ({"margin": 0.0}, {"distance": math.inf}):
        with pytest.raises(ValueError, match="must be positive"):
            Gap(still, **arguments)
    envs = make_envs(make, 1)
    for arguments in ({"horizon": 0.0}, {"samples": (1, 5)}, {"clearance_weight": -1.0}):
        with pytest.raises(ValueError, match=next(iter(arguments))):
            DynamicWindow(envs, **arguments)
    with pytest.raises(ValueError, match="SAME_STEP"):
        evaluate(Gap(envs), make(FlatlandVectorEnv, 1, "corridor"), 1)
    with pytest.raises(ValueError, match="episodes"):
        evaluate(Gap(envs), envs, 0)


@pytest.mark.parametrize(("n", "episodes"), [(3, 7), (4, 2), (1, 2)])
def test_no_other_episodes_begin(
    make: Make, monkeypatch: pytest.MonkeyPatch, n: int, episodes: int
) -> None:
    begun = []
    begin = Episodes.begin
    monkeypatch.setattr(Episodes, "begin", lambda self, *a: (begun.append(a[0]), begin(self, *a)))
    envs = make_envs(make, n, max_steps=20)
    outcomes = evaluate(Gap(envs), envs, episodes, seed=3)
    assert len(begun) == episodes == len(outcomes.steps)
    with pytest.raises(ResetNeeded, match="no episode has begun"):
        envs.step(np.zeros((n, 2)))
    many = make_envs(make, 5, max_steps=20)
    for name in ("is_success", "collision", "steps"):
        other = getattr(evaluate(Gap(many), many, episodes, seed=3), name)
        np.testing.assert_array_equal(getattr(outcomes, name), other)


def test_an_evaluation_of_discrete_actions_with_idle_environments(make: Make) -> None:
    action = DiscreteAction([(1.0, 0.0), (0.0, 1.0)])
    envs = make_envs(make, 3, max_steps=4, action=action)
    assert evaluate(lambda _: [0, 1, 1], envs, 1).steps.tolist() == [4]
