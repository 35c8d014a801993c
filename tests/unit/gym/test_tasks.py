"""Starts and goals."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError
from nested import assert_same

import flatland
from flatland.gym import Buildings, FixedGoal, FlatlandVectorEnv, RandomGoal

Make = Callable[..., Any]

# Two rooms without a door between them, and one with a door far from the robot.
ROOMS = """
0 0  9 0
9 0  9 6
9 6  0 6
0 6  0 0
3 0  3 6
6 0  6 5
"""


@pytest.fixture
def rooms(room: Path) -> Path:
    (room.parent / "walls.lines").write_text(ROOMS)
    room.write_text(room.read_text().replace("pose: [1, 1, 0]", "pose: [4.5, 1, 0]"))
    return room


def draws(make: Make, n: int, world: Path, task: RandomGoal) -> np.ndarray:
    """Returns the starts and goals of n episodes."""
    env = make(world=world, task=task)
    rows = []
    for seed in range(n):
        env.reset(seed=seed)
        rows.append((*env.world.model("robot").pose, *env.goal))
    return np.array(rows)


def test_places_are_reachable_free_and_clear(make: Make, rooms: Path) -> None:
    task = RandomGoal(distance=(0.5, 4.0), clearance=0.2, margin=None)
    drawn = draws(make, 100, rooms, task)
    for x, y in (drawn[:, 0:2].T, drawn[:, 3:5].T):
        assert x.min() >= 3 + 0.4 - 1e-3  # never in the room without a door
        assert x.max() <= 9 - 0.4 + 1e-3
        assert y.min() >= 0.4 - 1e-3
        assert (x > 6).any()
        assert (x < 6).any()
        beside_wall = y < 5
        assert (np.abs(x[beside_wall] - 6) >= 0.4 - 1e-3).all()
    distance = np.hypot(*(drawn[:, 3:5] - drawn[:, 0:2]).T)
    assert distance.min() >= 0.5
    assert distance.max() <= 4.0
    assert len(np.unique(drawn[:, 2])) == 100


def test_a_margin_excludes_detours(make: Make, rooms: Path) -> None:
    def crosses(drawn: np.ndarray) -> np.ndarray:
        """Where the wall with the far door is between start and goal."""
        return ((drawn[:, 0] < 6) != (drawn[:, 3] < 6)) & (drawn[:, 1] < 3) & (drawn[:, 4] < 3)

    assert crosses(draws(make, 100, rooms, RandomGoal(distance=(0.5, 4), margin=None))).any()
    assert not crosses(draws(make, 100, rooms, RandomGoal(distance=(0.5, 4), margin=0.5))).any()


def test_models_are_not_overlapped(make: Make, room: Path) -> None:
    (room.parent / "box.model.yaml").write_text(
        "bodies: [{name: box, footprints: [{type: circle, radius: 1.2, density: 5}]}]\n"
    )
    room.write_text(room.read_text() + "  - {name: box, model: box.model.yaml, pose: [4, 2, 0]}\n")
    drawn = draws(make, 50, room, RandomGoal(distance=(0.5, 4.0), clearance=0.1))
    for places in (drawn[:, 0:2], drawn[:, 3:5]):
        assert np.hypot(*(places - (4, 2)).T).min() >= 1.2 + 0.2 + 0.1 - 0.01


def test_the_region_can_be_chosen(make: Make, rooms: Path) -> None:
    drawn = draws(make, 30, rooms, RandomGoal(distance=(0.5, 4.0), origin=(1.5, 3.0)))
    assert drawn[:, 0].max() < 3
    with pytest.raises(flatland.WorldError, match=r"connected_to \(3, 3\) is not free"):
        make(world=rooms, task=RandomGoal(origin=(3.0, 3.0)))


def test_a_robot_without_a_place_gets_the_largest_region(make: Make, rooms: Path) -> None:
    rooms.write_text(rooms.read_text().replace("pose: [4.5, 1, 0]", "pose: [3, 1, 0]"))
    drawn = draws(make, 30, rooms, RandomGoal(distance=(0.5, 4.0)))
    assert drawn[:, 0].min() > 3


def test_a_world_without_walls_or_room_is_an_error(make: Make, room: Path) -> None:
    with pytest.raises(flatland.WorldError, match="no place is free"):
        make(world=room, task=RandomGoal(clearance=3.0))
    room.write_text(room.read_text().replace("[{name: walls, map: map.yaml}]", "[]"))
    with pytest.raises(flatland.WorldError, match="no layer has walls"):
        make(world=room)


def test_a_fixed_goal_is_that_of_each_episode(make: Make, room: Path) -> None:
    env = make(world=room, task=FixedGoal((1, 2, 0.5), (4, 2)))
    for seed in range(3):
        env.reset(seed=seed)
        assert env.world.model("robot").pose == pytest.approx((1, 2, 0.5))
        assert env.goal == (4.0, 2.0)


def test_a_fixed_goal_without_a_path_is_an_error(make: Make, rooms: Path) -> None:
    make(world=rooms, task=FixedGoal((1, 2, 0), (2, 3)))  # in the closed room
    with pytest.raises(flatland.WorldError, match=r"goal .* cannot be .* disc of radius 0\.2 m"):
        make(world=rooms, task=FixedGoal((1, 2, 0), (4, 3)))


def test_places_around_open_walls_are_connected(make: Make, rooms: Path) -> None:
    walls = rooms.parent / "walls.lines"
    walls.write_text("\n".join(walls.read_text().split("\n")[2:]))  # without the lower wall
    env = make(world=rooms, task=FixedGoal((4.5, 3, 0), (4.5, -8)))
    env.reset(seed=0)
    assert env.goal == (4.5, -8.0)
    env = make(world=rooms)
    for goal in ((-5, 3), (1, 1), (7, 3)):  # around the walls, and in all rooms
        env.reset(seed=0, options={"goal": goal})
    (rooms.parent / "walls.lines").write_text(ROOMS)
    closed = make(world=rooms)
    closed.reset(seed=0, options={"goal": (7, 3)})
    for goal in ((-5, 3), (1, 1)):
        with pytest.raises(flatland.WorldError, match=r"goal .* cannot be reached"):
            closed.reset(seed=0, options={"goal": goal})


@pytest.mark.parametrize(
    "arguments",
    [
        {"distance": (2.0, 1.0)},
        {"distance": (0.1, 1.0)},
        {"distance": (1.0, math.inf)},
        {"goal_radius": 0.0},
        {"margin": -1.0},
        {"clearance": -0.1},
    ],
)
def test_an_invalid_number_is_an_error(make: Make, arguments: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(arguments))):
        make(world="corridor", task=RandomGoal(**arguments))


# -- curricula: the task changes between episodes ------------------------------------------------

FORWARD = np.array([1.0, 0.2], np.float32)
NEAR, FAR = RandomGoal((0.5, 1.0)), RandomGoal((4.0, 6.0))


def test_a_running_episode_continues_exactly(make: Make) -> None:
    changed, unchanged = (make(FlatlandVectorEnv, 3, "corridor", task=NEAR) for _ in range(2))
    assert_same(changed.reset(seed=2), unchanged.reset(seed=2))
    for step in range(8):
        if step == 4:
            changed.task = FAR
        actions = np.tile(FORWARD, (3, 1))
        assert_same(changed.step(actions), unchanged.step(actions))
        hashes = [[world.state_hash() for world in env.worlds] for env in (changed, unchanged)]
        assert hashes[0] == hashes[1]


@pytest.mark.parametrize("world", ["corridor", Buildings(["corridor"] * 3)])
def test_all_environments_of_a_vector_have_the_new_task(make: Make, world: Any) -> None:
    envs = make(FlatlandVectorEnv, 4, world, task=NEAR, autoreset_mode="SameStep", max_steps=5)
    envs.reset(seed=0)
    for _ in range(7):
        envs.step(np.tile(FORWARD, (4, 1)))
    envs.task = FAR
    assert envs.task is FAR
    _, infos = envs.reset(seed=1)
    assert (infos["distance"] >= 4.0).all()
    new = make(FlatlandVectorEnv, 4, world, task=FAR, autoreset_mode="SameStep", max_steps=5)
    new.reset(seed=1)
    np.testing.assert_array_equal(envs.goals, new.goals)
    np.testing.assert_array_equal(envs.poses, new.poses)


def test_an_impossible_task_is_an_error_and_the_previous_one_remains(make: Make) -> None:
    env = make(world="corridor", task=NEAR)
    env.reset(seed=0)
    with pytest.raises(flatland.WorldError, match="cannot be reached"):
        env.task = FixedGoal((1, 1, 0), (60, 1))
    with pytest.raises(TypeError, match="task must be a Task"):
        env.task = (1, 2)
    assert env.task is NEAR
    env.step(FORWARD)
    assert env.reset(seed=0)[1]["distance"] <= 1.0
    env.close()
    with pytest.raises(ClosedEnvironmentError):
        env.task = FAR
