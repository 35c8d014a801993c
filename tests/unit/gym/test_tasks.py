"""Starts and goals."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.gym import FixedGoal, RandomGoal

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
    env = make(world=world, task=task)
    rows = []
    for seed in range(n):
        env.reset(seed=seed)
        rows.append((*env.world.model("robot").pose, *env.goal))
    return np.array(rows)


def test_places_are_reachable_free_and_clear(make: Make, rooms: Path) -> None:
    task = RandomGoal(distance=(0.5, 4.0), clearance=0.2, margin=None)
    drawn = draws(make, 300, rooms, task)
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
    assert len(np.unique(drawn[:, 2])) == 300


def test_a_margin_excludes_detours(make: Make, rooms: Path) -> None:
    def crosses(drawn: np.ndarray) -> np.ndarray:
        """Where the wall with the far door is between start and goal."""
        return ((drawn[:, 0] < 6) != (drawn[:, 3] < 6)) & (drawn[:, 1] < 3) & (drawn[:, 4] < 3)

    assert crosses(draws(make, 200, rooms, RandomGoal(distance=(0.5, 4), margin=None))).any()
    assert not crosses(draws(make, 200, rooms, RandomGoal(distance=(0.5, 4), margin=0.5))).any()


def test_models_are_not_overlapped(make: Make, room: Path) -> None:
    (room.parent / "box.model.yaml").write_text(
        "bodies: [{name: box, footprints: [{type: circle, radius: 1.2, density: 5}]}]\n"
    )
    room.write_text(room.read_text() + "  - {name: box, model: box.model.yaml, pose: [4, 2, 0]}\n")
    drawn = draws(make, 100, room, RandomGoal(distance=(0.5, 4.0), clearance=0.1))
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


def test_a_world_without_walls_is_an_error(make: Make, room: Path) -> None:
    (room.parent / "robot.model.yaml").write_text((room.parent / "robot.model.yaml").read_text())
    text = room.read_text().replace("layers: [{name: walls, map: map.yaml}]", "layers: []")
    room.write_text(text)
    with pytest.raises(flatland.WorldError, match="no layer has walls"):
        make(world=room)


def test_a_map_without_room_is_an_error(make: Make, room: Path) -> None:
    with pytest.raises(flatland.WorldError, match="no place is free"):
        make(world=room, task=RandomGoal(clearance=3.0))


def test_a_fixed_goal_is_that_of_each_episode(make: Make, room: Path) -> None:
    env = make(world=room, task=FixedGoal((1, 2, 0.5), (4, 2)))
    for seed in range(3):
        env.reset(seed=seed)
        assert env.world.model("robot").pose == pytest.approx((1, 2, 0.5))
        assert env.goal == (4.0, 2.0)


def test_a_fixed_goal_without_a_path_is_an_error(make: Make, rooms: Path) -> None:
    make(world=rooms, task=FixedGoal((1, 2, 0), (2, 3)))  # in the closed room
    for goal, reason in (((4, 3), "no path of a disc of radius 0.2 m"), ((60, 0), "outside")):
        with pytest.raises(flatland.WorldError, match=f"goal .* cannot be reached: .*{reason}"):
            make(world=rooms, task=FixedGoal((1, 2, 0), goal))


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
    ],
)
def test_an_invalid_number_is_an_error(arguments: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(arguments))):
        RandomGoal(**arguments)


def test_an_invalid_clearance_is_an_error(make: Make, room: Path) -> None:
    with pytest.raises(ValueError, match="clearance"):
        make(world=room, task=RandomGoal(clearance=-0.1))
