"""Observations that are images, and stacked observations."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from pettingzoo.test import parallel_api_test

from flatland.gym import (
    Costmap,
    FixedGoal,
    FlatlandEnv,
    Goal,
    LocalMap,
    Observation,
    ObservationPart,
    Scan,
    Stacked,
    Velocity,
    make_parallel,
)

Make = Callable[..., Any]

BOX = (
    "bodies: [{name: base, type: static, footprints: "
    "[{type: polygon, density: 1, points: [[-0.3, -0.1], [0.3, -0.1], [0.3, 0.1], [-0.3, 0.1]]}]}]"
)
FREE, UNKNOWN, OCCUPIED = 0, 127, 255


@pytest.fixture
def hall(room: Path) -> Path:
    """The room of 6 m by 4 m with an exact laser, and a box of 0.6 m by 0.2 m at (4, 3)."""
    robot = room.parent / "robot.model.yaml"
    text = robot.read_text().replace("noise_std_dev: 0.02", "origin: [0.1, 0, 0]")
    robot.write_text(text.replace("increment: 0.25", "increment: 0.01"))
    (room.parent / "box.model.yaml").write_text(BOX)
    text = room.read_text()
    room.write_text(f"{text}  - {{name: box, model: box.model.yaml, pose: [4, 3, 0]}}\n")
    return room


def observed(
    make: Make, world: Path, part: ObservationPart, start: Any, goal: Any = (5, 1)
) -> np.ndarray:
    env = make(world=world, observation=Observation(part), task=FixedGoal(start, goal))
    image: np.ndarray = env.reset(seed=0)[0]
    assert env.observation_space.contains(image)
    return image


def cell(ahead: float, left: float, count: int = 64, resolution: float = 0.1) -> tuple[int, int]:
    """Returns row and column of a point in the frame of the robot [m]."""
    reach = 0.5 * count * resolution
    return (math.floor((reach - ahead) / resolution), math.floor((reach - left) / resolution))


# -- costmaps ----------------------------------------------------------------------------------


def test_a_costmap_contains_what_the_laser_measures(make: Make, hall: Path) -> None:
    image = observed(make, hall, Costmap(), (3.45, 2, 0))  # walls 2.55 m ahead, 2 m to the sides
    assert image.shape == (64, 64, 1)
    assert image.dtype == np.uint8
    grid = image[..., 0]
    assert set(np.unique(grid)) == {FREE, UNKNOWN, OCCUPIED}
    for place, value in (
        ((2.55, 0.05), OCCUPIED),
        ((2.35, 0.05), FREE),
        ((2.75, 0.05), UNKNOWN),
        ((0.55, -1.05), FREE),
        ((0.55, -1.99), OCCUPIED),
        ((0.55, -2.15), UNKNOWN),
        ((0.55, 0.75), FREE),
        ((0.55, 0.91), OCCUPIED),  # the box
        ((0.55, 1.5), UNKNOWN),  # behind it
        ((-1.0, 0.05), UNKNOWN),  # behind the robot
    ):
        assert grid[cell(*place)] == value, place


def test_all_hits_are_occupied_and_all_free_cells_are_in_front_of_hits(
    make: Make, hall: Path
) -> None:
    env = make(world=hall, observation=Observation(Costmap(80, 0.05)))
    for seed in range(3):
        image, _ = env.reset(seed=seed)
        laser, ranges = env.episodes.agents[0].laser, env.episodes.situation.ranges[0]
        angles = laser.angles.minimum + laser.angles.increment * np.arange(len(ranges))
        hits = ranges < 4.0
        occupied = np.zeros((80, 80), np.bool_)
        for r, angle in zip(ranges[hits], angles[hits], strict=True):
            row, column = cell(0.1 + r * np.cos(angle), r * np.sin(angle), 80, 0.05)
            if 0 <= row < 80 and 0 <= column < 80:
                occupied[row, column] = True
        # Points at the border of two cells may belong to either of them.
        assert (occupied != (image[..., 0] == OCCUPIED)).sum() <= 2
        for row, column in np.argwhere(image[..., 0] == FREE):
            ahead, left = 2.0 - 0.05 * (row + 0.5) - 0.1, 2.0 - 0.05 * (column + 0.5)
            beam = np.abs(angles - math.atan2(left, ahead)).argmin()
            assert math.hypot(ahead, left) < np.nan_to_num(ranges[beam], nan=4.0) + 0.02


def test_a_costmap_of_numbers(make: Make, hall: Path) -> None:
    image = observed(make, hall, Costmap(), (3, 2, 0))[..., 0]
    numbers = observed(make, hall, Costmap(as_image=False), (3, 2, 0))
    assert numbers.dtype == np.float32
    values = {FREE: 0.0, UNKNOWN: 0.5, OCCUPIED: 1.0}
    np.testing.assert_array_equal(numbers, np.vectorize(values.get)(image))


# -- maps of the surroundings ------------------------------------------------------------------


def test_a_local_map_contains_walls_models_and_the_goal(make: Make, hall: Path) -> None:
    image = observed(make, hall, LocalMap(), (3.45, 1.95, 0), (4.45, 0.95))
    assert image.shape == (64, 64, 3)
    assert image.dtype == np.uint8
    walls, models, goal = np.moveaxis(image, -1, 0)
    for channel, place in (
        (walls, (2.55, 0.0)),
        (walls, (0.55, 2.05)),  # behind the box, for a laser
        (walls, (-1.0, -1.95)),
        (models, (0.55, 1.05)),
        (models, (0.35, 1.0)),
        (goal, (1.0, -1.0)),
        (goal, (1.2, -1.1)),
    ):
        assert channel[cell(*place)] == 255, place
    assert walls[cell(0.0, 0.0)] == models[cell(0.0, 0.0)] == 0
    assert (models > 0).sum() * 0.01 == pytest.approx(0.6 * 0.2, abs=0.06)
    assert (goal > 0).sum() * 0.01 == pytest.approx(math.pi * 0.3**2, rel=0.2)
    # A rectangle of which 2.55 m + 3.2 m and 4 m are in the image.
    assert (walls > 0).sum() == pytest.approx(2 * 57.5 + 40, abs=5)


def test_a_local_map_turns_with_the_robot(make: Make, hall: Path) -> None:
    ahead = observed(make, hall, LocalMap(), (3, 2.05, math.pi / 2))
    assert ahead[cell(0.95, -1.0)][1] == 255
    assert ahead[cell(1.95, 0.0)][0] == 255


def test_a_distant_goal_is_at_the_edge(make: Make, hall: Path) -> None:
    image = observed(make, hall, LocalMap(20), (1, 1, 0), (5, 1))
    assert image[0, 9:11, 2].max() == 255
    assert image[4:, :, 2].max() == 0


def test_a_local_map_contains_other_robots(make: Make) -> None:
    env = make(make_parallel, num_robots=2, observation=Observation(LocalMap()))
    env.reset(seed=0)
    env.world.move_model("robot_0", (6, 6, 0))
    env.world.move_model("robot_1", (7, 6, 0))
    images, *_ = env.step({name: np.array([-1.0, 0.0]) for name in env.agents})
    assert images["robot_0"][cell(1.0, 0.0)][1] == 255
    area = (images["robot_0"][..., 1] > 0).sum() * 0.01
    assert area == pytest.approx(math.pi * 0.2**2, rel=0.3)


# -- stacked observations ----------------------------------------------------------------------


def test_observations_are_stacked_from_the_oldest_to_the_newest(make: Make, hall: Path) -> None:
    env = make(world=hall, observation=Observation(Goal(), Stacked(Velocity(), 3)))
    first, _ = env.reset(seed=0)
    velocities = [first[-2:]] * 3
    np.testing.assert_array_equal(first[3:], np.concatenate(velocities))
    for _ in range(5):
        observation, *_ = env.step(np.array([0.3, 0.2], np.float32))
        velocities.append(observation[-2:])
        np.testing.assert_array_equal(observation[3:], np.concatenate(velocities[-3:]))
    again, _ = env.reset(seed=0)
    np.testing.assert_array_equal(again, first)


def test_channels_of_images_are_stacked(make: Make, hall: Path) -> None:
    plain = make(world=hall, observation=Observation(LocalMap(16, 0.3)))
    stacked = make(world=hall, observation=Observation(Stacked(LocalMap(16, 0.3), 4)))
    assert stacked.observation_space == spaces.Box(0, 255, (16, 16, 12), np.uint8)
    images = [plain.reset(seed=1)[0]] * 4
    np.testing.assert_array_equal(stacked.reset(seed=1)[0], np.concatenate(images, axis=-1))
    for _ in range(6):
        images.append(plain.step(np.array([-0.8, 1.0]))[0])
        observation = stacked.step(np.array([-0.8, 1.0]))[0]
        np.testing.assert_array_equal(observation, np.concatenate(images[-4:], axis=-1))


# -- conformity --------------------------------------------------------------------------------

ALL = Observation(
    Costmap(16, 0.3), Stacked(LocalMap(12, 0.5), 2), Stacked(Scan(), 3), Goal(), as_dict=True
)


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.DISABLED])
def test_a_vector_equals_single_environments(
    equals_singles: Callable[..., Any], room: Path, mode: AutoresetMode
) -> None:
    equals_singles(3, 30, mode, world=room, observation=ALL, max_steps=8)


def test_checkers_find_nothing(make: Make, hall: Path) -> None:
    for observation in (ALL, Observation(LocalMap(40)), Observation(Costmap(40, as_image=False))):
        check_env(make(world=hall, observation=observation), skip_render_check=True)
    parallel_api_test(make(make_parallel, num_robots=2, observation=ALL), 10)


# -- errors ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "create",
    [
        lambda: Costmap(1),
        lambda: Costmap(resolution=0.0),
        lambda: LocalMap(pixels=2.5),
        lambda: LocalMap(resolution=math.inf),
        lambda: LocalMap(goal_radius=-1.0),
        lambda: Stacked(Scan(), 0),
    ],
)
def test_a_number_out_of_range_is_an_error(create: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match="must be"):
        create()


def test_an_image_beside_other_parts_requires_a_dictionary(hall: Path) -> None:
    for part in (Costmap(), LocalMap(), Stacked(LocalMap(), 2)):
        with pytest.raises(ValueError, match="requires as_dict=True"):
            FlatlandEnv(hall, observation=Observation(Goal(), part))
