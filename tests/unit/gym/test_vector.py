"""Many environments: equal to as many single ones, in all autoreset modes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, InvalidAction, ResetNeeded
from gymnasium.vector import AutoresetMode
from nested import assert_same

from flatland.errors import WorldError
from flatland.gym import FlatlandVectorEnv, Goal, Observation, Scan, Velocity, stage

Make = Callable[..., Any]
MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP, AutoresetMode.DISABLED]


def actions(n: int, steps: int, seed: int = 0) -> np.ndarray:
    """Mostly forward, so that episodes end soon."""
    numbers = np.random.default_rng(seed).uniform(-1, 1, (steps, n, 2))
    numbers[..., 0] = np.abs(numbers[..., 0])
    return numbers.astype(np.float32)


@pytest.mark.parametrize(
    ("world", "mode", "num_threads"),
    [
        *(("corridor", mode, 3) for mode in MODES),
        ("room", AutoresetMode.NEXT_STEP, 1),
    ],
)
def test_it_equals_single_environments(
    equals_singles: Callable[..., Any],
    room: Path,
    world: str,
    mode: AutoresetMode,
    num_threads: int,
) -> None:
    path = room if world == "room" else world
    _, ended = equals_singles(3, 80, mode, num_threads, world=path, max_steps=20)
    assert ended > 9


def test_dictionaries_of_observations_equal_those_of_single_environments(
    equals_singles: Callable[..., Any],
) -> None:
    observation = Observation(Scan(12), Velocity(), Goal(), as_dict=True)
    equals_singles(3, 60, AutoresetMode.SAME_STEP, world="corridor", observation=observation)


def test_the_number_of_threads_changes_nothing(make: Make) -> None:
    runs = []
    for num_threads in (0, 1, 7):
        envs = make(FlatlandVectorEnv, 8, "corridor", num_threads=num_threads, max_steps=15)
        envs.reset(seed=3)
        runs.append([envs.step(action) for action in actions(8, 20)])
    for other in runs[1:]:
        for left, right in zip(runs[0], other, strict=True):
            assert_same(left, right)


def test_seeds_are_those_of_single_environments(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 3, "corridor")
    by_number, _ = envs.reset(seed=5)
    by_list, _ = envs.reset(seed=[5, 6, 7])
    np.testing.assert_array_equal(by_number, by_list)
    assert envs.np_random_seed == (5, 6, 7)
    partly, _ = envs.reset(seed=[5, None, 7])
    np.testing.assert_array_equal(partly[[0, 2]], by_list[[0, 2]])
    assert (partly[1] != by_list[1]).any()
    with pytest.raises(ValueError, match="3 environments, got 2"):
        envs.reset(seed=[1, 2])


def test_observations_are_copies_unless_told_otherwise(make: Make) -> None:
    for copy in (True, False):
        envs = make(FlatlandVectorEnv, 2, "corridor", copy=copy)
        first, _ = envs.reset(seed=0)
        kept = first.copy()
        second = envs.step(np.ones((2, 2)))[0]
        assert (first is second) is not copy
        assert np.array_equal(first, kept) is copy


def test_the_metadata_name_the_autoreset_mode(make: Make) -> None:
    for mode in MODES:
        envs = make(FlatlandVectorEnv, 1, "corridor", autoreset_mode=mode)
        assert envs.metadata["autoreset_mode"] is mode
    by_name = make(FlatlandVectorEnv, 1, "corridor", autoreset_mode="SameStep")
    assert by_name.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


def test_rendering_returns_an_image_of_each(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor", render_mode="rgb_array")
    envs.reset(seed=0)
    images = envs.render()
    assert [image.shape for image in images] == [(600, 800, 3)] * 2
    assert (images[0] != images[1]).any()
    assert make(FlatlandVectorEnv, 1, "corridor").render() is None


# -- access to the environments, options ----------------------------------------------------------


def test_poses_goals_and_worlds_are_public(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 3, "corridor")
    envs.reset(seed=0)
    envs.step(np.ones((3, 2)))
    models = [world.model("robot") for world in envs.worlds]
    assert envs.poses == pytest.approx(np.array([model.pose for model in models]))
    assert envs.goals.shape == (3, 2)
    distances = np.hypot(*(envs.goals - envs.poses[:, :2]).T)
    assert distances == pytest.approx(envs.step(-np.ones((3, 2)))[4]["distance"], abs=0.1)
    envs.poses[:] = envs.goals[:] = 0.0  # Both are copies.
    assert envs.poses.all()


def test_starts_and_goals_apply_to_the_selected_environments(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 3, "corridor")
    drawn = make(FlatlandVectorEnv, 3, "corridor")
    drawn.reset(seed=4)
    starts = [(1, 1.0, 0), (2, 1.25, 1), (5, 1.25, 2)]
    envs.reset(seed=4, options={"start": starts, "goal": (8, 1.25)})
    assert envs.poses == pytest.approx(np.array(starts))
    np.testing.assert_array_equal(envs.goals, [(8, 1.25)] * 3)
    mask = np.array([False, True, True])
    envs.reset(seed=4, options={"start": starts, "start_mask": mask})
    np.testing.assert_array_equal(envs.poses[0], drawn.poses[0])
    assert envs.poses[1:] == pytest.approx(np.array(starts[1:]))
    before = envs.poses
    only_first = np.array([True, False, False])
    envs.reset(options={"start": (9, 1.25, 0), "reset_mask": only_first})
    assert envs.poses[0] == pytest.approx((9, 1.25, 0))
    np.testing.assert_array_equal(envs.poses[1:], before[1:])


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"aim": (1, 1)}, ValueError, "start_mask, got aim"),
        ({"start": (1, 1)}, ValueError, r"shape \(3,\) or \(2, 3\)"),
        ({"goal": ["a", "b"]}, ValueError, "must be numbers"),
        ({"goal": (1j, 1)}, ValueError, "must be numbers"),
        ({"goal_mask": np.array([True, False])}, ValueError, "goal_mask.* requires"),
        ({"goal": (8, 1), "goal_mask": [1, 0]}, TypeError, "goal_mask"),
        ({"goal": [(8, 1), (60, 0)]}, WorldError, r"environment 1: the goal \(60, 0\) .* outside"),
        ({"start": (-9, 0, 0)}, WorldError, "environment 0: the start .* outside"),
        ({"goal": [(8, 1), (np.nan, 0)]}, ValueError, "finite"),
    ],
)
def test_an_invalid_option_is_an_error(
    make: Make, options: dict[str, Any], error: type[Exception], message: str
) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor")
    with pytest.raises(error, match=message):
        envs.reset(seed=0, options=options)
    envs.reset(seed=0)
    envs.step(np.zeros((2, 2)))


@pytest.mark.parametrize("count", [np.int64(2), np.uint8(2)])
def test_counts_may_be_integers_of_numpy(make: Make, count: Any) -> None:
    envs = make(FlatlandVectorEnv, count, "corridor", num_threads=count, max_steps=count)
    envs.reset(seed=0)
    assert not envs.step(np.zeros((2, 2)))[3].any()
    assert envs.step(np.zeros((2, 2)))[3].all()
    assert type(envs.num_envs) is int


@pytest.mark.parametrize("count", [2.0, True, np.bool_(True), np.array([1, 2]), "2"])
def test_other_counts_are_errors(count: Any) -> None:
    with pytest.raises(ValueError, match="num_envs must be an integer of at least 1"):
        FlatlandVectorEnv(count, "corridor")


# -- errors ------------------------------------------------------------------------------------


def test_stepping_needs_a_reset(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor", autoreset_mode="Disabled", max_steps=1)
    with pytest.raises(ResetNeeded, match="no episode has begun"):
        envs.step(np.zeros((2, 2)))
    envs.reset(seed=0, options={"reset_mask": np.array([True, False])})
    with pytest.raises(ResetNeeded, match="no episode has begun"):
        envs.step(np.zeros((2, 2)))
    envs.reset(seed=0)
    envs.step(np.zeros((2, 2)))
    with pytest.raises(ResetNeeded, match="environment 0 has ended"):
        envs.step(np.zeros((2, 2)))


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros((3, 2)), r"shape \(2, 2\), got \(3, 2\)"),
        (np.zeros(2), r"shape \(2, 2\), got \(2,\)"),
        (np.array([[0, 0], [0, np.nan]]), r"nan\] for agent 1"),
        (np.ones((2, 2), complex), "must be numbers"),
        (np.full((2, 2), "0.5"), "must be numbers"),
    ],
)
def test_invalid_actions_are_errors(make: Make, action: np.ndarray, message: str) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor")
    envs.reset(seed=0)
    with pytest.raises(InvalidAction, match=message):
        envs.step(action)
    envs.step(np.zeros((2, 2)))


@pytest.mark.parametrize(
    ("mask", "error"),
    [
        ([True, False], TypeError),
        (np.array([1, 0]), TypeError),
        (np.array([True]), ValueError),
        (np.array([False, False]), ValueError),
    ],
)
def test_an_invalid_mask_is_an_error(make: Make, mask: object, error: type[Exception]) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor")
    with pytest.raises(error, match="reset_mask"):
        envs.reset(options={"reset_mask": mask})


def test_closed_environments_are_of_no_use(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor")
    envs.reset(seed=0)
    envs.close()
    envs.close()
    for use in (lambda: envs.step(np.zeros((2, 2))), envs.reset, envs.render):
        with pytest.raises(ClosedEnvironmentError, match="closed"):
            use()


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"num_envs": 0}, "num_envs"),
        ({"num_threads": -1}, "num_threads"),
        ({"autoreset_mode": "Never"}, "Never"),
        ({"render_mode": "ansi"}, "rgb_array, human"),
    ],
)
def test_an_invalid_argument_is_an_error(kwargs: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FlatlandVectorEnv(**{"num_envs": 1, "world": "corridor", **kwargs})


def test_too_many_environments_are_refused_with_the_memory_that_they_need(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    numbers = {"/proc/meminfo": "MemTotal: 8 kB\nMemAvailable:  1000000 kB\n"}
    monkeypatch.setattr(stage, "_read", lambda path: numbers.get(path, "max"))
    text = r"50000 environments need about [1-9]\d*\.\d GB, and 1\.0 GB are available"
    with pytest.raises(MemoryError, match=text):
        make(FlatlandVectorEnv, 50_000)
