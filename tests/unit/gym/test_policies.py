"""Policies in ONNX files, of which one is included."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flatland.gym import FlatlandEnv, FlatlandVectorEnv, evaluate
from flatland.gym.policies import INCLUDED, Policy, PolicyError, PolicyRobot

Make = Callable[..., Any]


def test_the_included_policy_reaches_goals(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 8, autoreset_mode="SameStep")
    outcomes = evaluate(Policy(env=envs), envs, 24, seed=1_000_000)
    assert outcomes.success_rate >= 0.95
    assert outcomes.collision_rate <= 0.02


def test_the_included_policy_is_small() -> None:
    assert INCLUDED.stat().st_size < 1_000_000


def test_actions_do_not_depend_on_other_environments(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 4)
    policy, singles = Policy(env=envs), [Policy() for _ in range(4)]
    observations, _ = envs.reset(seed=1)
    for _ in range(5):
        actions = policy(observations)
        assert actions.shape == (4, 2)
        assert actions.dtype == np.float32
        for row, single in enumerate(singles):
            action = single(observations[row])
            assert envs.single_action_space.contains(action)
            np.testing.assert_allclose(action, actions[row], atol=1e-5)
        observations = envs.step(actions)[0]


def test_a_reset_applies_to_the_selected_episodes(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 3)
    policy, fresh = Policy(), Policy()
    observations, _ = envs.reset(seed=1)
    first = policy(observations)
    later = policy(observations)  # The headings differ from the last ones.
    policy.reset(np.array((True, False, True)))
    after = policy(observations)
    np.testing.assert_array_equal(after[[0, 2]], first[[0, 2]])
    assert (later[1] != first[1]).any()
    assert (after[1] != first[1]).any()
    for _ in range(2):
        np.testing.assert_array_equal(fresh(observations), first)
        fresh.reset()


def test_a_policy_for_another_robot_is_an_error(make: Make) -> None:
    env = make(FlatlandEnv, physics_steps=10)
    with pytest.raises(PolicyError, match=r"dt=0\.1\).* the environment has .*dt=0\.05\)"):
        Policy(env=env)
    assert PolicyRobot.from_metadata(PolicyRobot.of(env).metadata()) == PolicyRobot.of(env)


@pytest.mark.parametrize("shape", [(184,), (2, 186), (1, 1, 185), ()])
def test_observations_of_another_shape_are_errors(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"shape \(185,\) or \(n, 185\), got"):
        Policy()(np.zeros(shape, np.float32))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (None, "file not found"),
        (lambda data: b"policy", "not a valid ONNX file"),
        (lambda data: data.replace(b"next_state", b"last_state"), "next_state, got .*last_state"),
        (lambda data: data.replace(b'"beams"', b'"beans"'), "not a policy of flatland.*beams"),
    ],
)
def test_invalid_files_are_errors(
    change: Callable[[bytes], bytes] | None, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "other.onnx"
    if change is not None:
        path.write_bytes(change(INCLUDED.read_bytes()))
    with pytest.raises(PolicyError, match=message) as caught:
        Policy(path)
    assert str(path) in str(caught.value)


def test_another_duration_of_actions_is_refused(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 1, autoreset_mode="SAME_STEP", physics_steps=100)
    with pytest.raises(PolicyError, match=r"trained with actions of 0\.1 s, here they last 0\.5 s"):
        evaluate(Policy(), envs, 1)
    with pytest.raises(PolicyError, match=r"dt=0\.1.* dt=0\.5"):
        Policy(env=envs)
    same = make(FlatlandVectorEnv, 1, autoreset_mode="SAME_STEP", physics_steps=10, step_size=0.01)
    assert len(evaluate(Policy(), same, 1).steps) == 1
