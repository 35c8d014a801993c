"""Goals and waypoints of people outside of walls, and worlds that are larger than their grid."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from rooms_with_people import CALM, ONE, load, people_of

import flatland
from flatland.errors import FlatlandError, WorldError
from tests.unit.conftest import WorldFiles

HALL = "0 0 10 0\n10 0 10 10\n10 10 0 10\n0 10 0 0\n0 5 8.8 5\n"  # with a gap of 1.2 m
OPEN = "0 0 10 0\n10 0 10 10\n0 10 0 0\n0 5 8.8 5\n"
STRAYS = ["1000 1000 1001 1000", "-700 20 -700 900\n3000 -40 3000.5 -40\n60000 9 60001 7"]
CROSSING = (
    "[{name: a, count: 6, area: [0.5, 0.5, 9, 9.5], "
    "waypoints: [{at: [1, 1]}, {at: [1, 9]}], order: back_and_forth}]"
)


def load_lines(files: WorldFiles, lines: str, groups: str, options: str = "") -> flatland.World:
    """Loads a world with line segments and people."""
    files.write("lines.dat", lines)
    files.write("lines.yaml", "{type: line_segments, data: lines.dat, scale: 1, origin: [0, 0, 0]}")
    return files.load(
        "properties: {}\nlayers: [{name: 2d, map: lines.yaml}]\n"
        f"plugins:\n- {{name: people, type: Pedestrians, {options}groups: {groups}}}\n",
        seed=1,
    )


@pytest.mark.parametrize("walls", [HALL, OPEN])
@pytest.mark.parametrize("stray", STRAYS)
def test_walls_far_away_do_not_change_how_people_walk(
    files: WorldFiles, walls: str, stray: str
) -> None:
    worlds = [load_lines(files, walls + more, CROSSING) for more in ("", stray + "\n")]
    for world in worlds:
        world.step(3000)
    poses = [people_of(world).people.poses for world in worlds]
    np.testing.assert_array_equal(poses[0], poses[1])
    places = poses[1][:, :2]
    assert places.min() > 0.1
    assert places.max() < 9.9


def test_those_who_wander_remain_where_most_walls_are(files: WorldFiles) -> None:
    world = load_lines(files, HALL + STRAYS[1], "[{name: a, count: 8, places: 4}]")
    places = people_of(world).people.poses[:, :2]
    assert places.min() > 0
    assert places.max() < 10


@pytest.mark.parametrize("goal", [(14.0, 2.0), (3.0, -2000.0), (1e8, 1e8)])
def test_a_goal_outside_of_closed_walls_is_refused(
    files: WorldFiles, goal: tuple[float, float]
) -> None:
    world = load(files, ONE % "[8, 3]", CALM)
    people = people_of(world)
    names = people.spawn(poses=[(2.0, 3.0, 0.0)])
    before = world.state_hash()
    text = (
        f'there is no way for "a_0" to the goal ({goal[0]:g}, {goal[1]:g}), which is outside of '
        "the walls, which extend from (0, 0) to (10, 6)"
    )
    with pytest.raises(WorldError, match=re.escape(text)):
        people.send(names, goal)
    assert world.state_hash() == before
    with pytest.raises(WorldError, match=r"\(1e\+30, 0\) is beyond the greatest coordinate"):
        people.send(names, (1e30, 0.0))


def test_people_leave_open_walls_for_a_goal_outside(files: WorldFiles) -> None:
    world = load_lines(files, OPEN, ONE % "[8, 8]", CALM)
    people = people_of(world)
    names = people.spawn(poses=[(8.0, 8.0, 0.0)])
    people.send(names, (8.0, 20.0))
    world.step(4000)
    assert people.people.poses[0, :2] == pytest.approx((8.0, 20.0), abs=0.35)
    text = r"the goal \(8, 50000\): the ways of people in an area of .* need .* cells of 0.1 m"
    with pytest.raises(WorldError, match=text):
        people.send(names, (8.0, 50000.0))
    world.step(10)


@pytest.mark.parametrize(
    ("waypoint", "text"),
    [
        ("[300, 2]", r"to the waypoint \(300, 2\), which is outside of the walls"),
        ("[100000, 2]", r"A waypoint at \(100000, 2\) is too far away: the ways of people in an"),
        ("[100, -90000]", r"at most 4000000 are possible \[.*world.yaml:4\]"),
    ],
)
def test_a_waypoint_outside_is_an_error_with_its_place(
    files: WorldFiles, waypoint: str, text: str
) -> None:
    group = f"[{{name: a, count: 2, waypoints: [{{at: {waypoint}}}]}}]"
    with pytest.raises(FlatlandError, match=text):
        load_lines(files, HALL, group)


def test_a_world_that_is_too_large_asks_for_larger_cells(files: WorldFiles) -> None:
    lines = "0 0 900 0\n900 0 900 900\n900 900 0 900\n0 900 0 0\n0 5 60 5\n"
    group = "[{name: a, count: 1, area: [1, 1, 9, 4], waypoints: [{at: [5, 2]}]}]"
    with pytest.raises(FlatlandError, match=r"902 m x 902 m need 81360400 cells of 0.1 m"):
        load_lines(files, lines, group)
    world = load_lines(files, lines, group, "cell: 0.5, ")
    world.step(200)
    x, y = people_of(world).people.poses[0, :2]
    assert math.dist((x, y), (5, 2)) < 1.5
