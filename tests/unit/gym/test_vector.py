"""Many environments: equal to as many single ones, in all autoreset modes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.vector import AutoresetMode

from flatland.errors import WorldError
from flatland.gym import FlatlandVectorEnv, stage

Make = Callable[..., Any]


@pytest.mark.parametrize(
    ("world", "mode", "num_threads"),
    [
        ("corridor", AutoresetMode.NEXT_STEP, 3),
        ("corridor", AutoresetMode.SAME_STEP, 0),
        ("corridor", AutoresetMode.DISABLED, 7),
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
    for name, mode in (("SameStep", AutoresetMode.SAME_STEP), (AutoresetMode.DISABLED,) * 2):
        envs = make(FlatlandVectorEnv, 1, "corridor", autoreset_mode=name)
        assert envs.metadata["autoreset_mode"] is mode
    assert make(FlatlandVectorEnv, 1).metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


def test_rendering_returns_images_with_the_goals(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor", render_mode="rgb_array")
    start = (1, 1.25, 0)
    envs.reset(seed=0, options={"start": start, "goal": [(5.0, 1.0), (8.0, 1.2)]})
    images = envs.render()
    assert [(image.shape, image.dtype) for image in images] == [((600, 800, 3), np.uint8)] * 2
    assert (images[0] != images[1]).any()
    env = make(world="corridor", render_mode="rgb_array")
    env.reset(seed=0, options={"start": start, "goal": (5.0, 1.0)})
    np.testing.assert_array_equal(env.render(), images[0])
    for plain in (make(FlatlandVectorEnv, 1, "corridor"), make(world="corridor")):
        assert plain.render() is None


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


def test_an_invalid_option_is_an_error(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor")
    for options, error, message in (
        ({"aim": (1, 1)}, ValueError, "start_mask, got aim"),
        ({"start": (1, 1)}, ValueError, r"shape \(3,\) or \(2, 3\)"),
        ({"goal": ["a", "b"]}, ValueError, "must be numbers"),
        ({"goal": (1j, 1)}, ValueError, "must be numbers"),
        ({"goal_mask": np.array([True, False])}, ValueError, "goal_mask.* requires"),
        ({"goal": (8, 1), "goal_mask": [1, 0]}, TypeError, "goal_mask"),
        ({"goal": [(8, 1), (60, 0)]}, WorldError, r"environment 1: the goal \(60, 0\) .* outside"),
        ({"start": (-9, 0, 0)}, WorldError, "environment 0: the start .* outside"),
        ({"goal": [(8, 1), (np.nan, 0)]}, ValueError, "finite"),
        ({"reset_mask": [True, False]}, TypeError, "reset_mask"),
        ({"reset_mask": np.array([1, 0])}, TypeError, "reset_mask"),
        ({"reset_mask": np.array([True])}, ValueError, "reset_mask"),
        ({"reset_mask": np.array([False, False])}, ValueError, "reset_mask"),
    ):
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


def test_invalid_actions_are_errors(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 2, "corridor")
    envs.reset(seed=0)
    for action, message in (
        (np.zeros((3, 2)), r"shape \(2, 2\), got \(3, 2\)"),
        (np.zeros(2), r"shape \(2, 2\), got \(2,\)"),
        (np.array([[0, 0], [0, np.nan]]), r"nan\] for agent 1"),
        (np.ones((2, 2), complex), "must be numbers"),
        (np.full((2, 2), "0.5"), "must be numbers"),
    ):
        with pytest.raises(InvalidAction, match=message):
            envs.step(action)
    envs.step(np.zeros((2, 2)))


COUNTS = [0, 2.0, True, np.bool_(True), np.array([1, 2]), "2"]


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        *(({"num_envs": count}, "num_envs must be an integer of at least 1") for count in COUNTS),
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


def test_worlds_share_their_walls(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 3)
    envs.reset(seed=0)
    walls = [world.physics.shared_fixtures for world in envs.worlds]
    assert walls == 3 * [envs.worlds[0].physics.object_counts().fixtures - 1] != [0, 0, 0]
    ends = 0
    for _ in range(400):
        _, _, terminated, truncated, _ = envs.step(np.full((3, 2), 1.0, np.float32))
        ends += (terminated | truncated).sum()
    assert ends > 3
    assert [world.physics.shared_fixtures for world in envs.worlds] == walls


def test_walls_that_an_episode_changes_are_shared_again_in_the_next_one(make: Make) -> None:
    changed, unchanged = make(FlatlandVectorEnv, 2), make(FlatlandVectorEnv, 2)
    for envs in (changed, unchanged):
        envs.reset(seed=0)
    world = changed.worlds[1]
    edges = world.layers[0].edges
    world.layers[0].body.set_pose(0.5, 0.0, 0.0)
    assert world.physics.shared_fixtures == 0
    changed.step(np.zeros((2, 2), np.float32))
    for envs in (changed, unchanged):
        envs.reset(seed=1)
    assert world.physics.shared_fixtures == len(edges)
    for _ in range(30):
        results = [envs.step(np.ones((2, 2), np.float32)) for envs in (changed, unchanged)]
        for one, other in zip(results[0][:4], results[1][:4], strict=True):
            assert np.array_equal(one, other)
