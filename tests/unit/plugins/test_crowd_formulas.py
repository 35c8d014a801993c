"""Formulas of the motion of people, and the solver of half-planes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flatland._core import (
    crowd_avoid,
    crowd_doors,
    crowd_is_clear,
    crowd_is_hidden,
    crowd_is_in_view,
    crowd_near_walls,
    crowd_repulsion,
    crowd_wall_repulsion,
    leg_offset,
    nearest_point,
    step_length,
)


def test_a_person_who_stands_repels_with_the_gradient_of_a_round_potential() -> None:
    # V0 / sigma exp(-d / sigma), away from the other person.
    x, y = crowd_repulsion((0.6, 0.8), (0.0, 0.0), {"strength": 2.1, "range": 0.3})
    assert math.hypot(x, y) == pytest.approx(7.0 * math.exp(-1.0 / 0.3))
    assert y / x == pytest.approx(0.8 / 0.6)


def test_the_repulsion_is_the_gradient_of_the_elliptic_potential() -> None:
    velocity, look_ahead, strength, sigma = (0.5, -0.3), 1.5, 2.0, 0.4

    def potential(x: float, y: float) -> float:
        sx, sy = look_ahead * velocity[0], look_ahead * velocity[1]
        total = math.hypot(x, y) + math.hypot(x - sx, y - sy)
        return strength * math.exp(-0.5 * math.sqrt(total**2 - sx**2 - sy**2) / sigma)

    x, y, h = 0.9, 0.4, 1e-6
    expected = (
        -(potential(x + h, y) - potential(x - h, y)) / (2 * h),
        -(potential(x, y + h) - potential(x, y - h)) / (2 * h),
    )
    numbers = {"strength": strength, "range": sigma, "look_ahead": look_ahead}
    assert crowd_repulsion((x, y), velocity, numbers) == pytest.approx(expected, rel=1e-6)


def test_repulsions_of_opposite_arguments_are_opposite() -> None:
    numbers = {"strength": 1.5, "range": 0.3, "look_ahead": 1.0}
    rng = np.random.default_rng(1)
    for scale in (1.0, 0.1, 1e-6, 1e-9):
        for x, y, vx, vy in (rng.normal(size=(100, 4)) * (scale, scale, 1, 1)).tolist():
            push = crowd_repulsion((x, y), (vx, vy), numbers)
            assert crowd_repulsion((-x, -y), (-vx, -vy), numbers) == (-push[0], -push[1])


def test_a_wall_repels_exponentially_with_the_distance_from_the_circumference() -> None:
    x, y = crowd_wall_repulsion((0.0, -0.5), 0.2, {"wall_strength": 5.0, "wall_range": 0.1})
    assert (x, y) == pytest.approx((0.0, -5.0 * math.exp(-3.0)))


def test_negligible_repulsions_are_zero() -> None:
    # The limit is 0.01 m/s²; the gradient is at most three times that of a round potential.
    for distance in np.arange(0.1, 6.0, 0.01).tolist():
        exact = 7.0 * math.exp(-distance / 0.3)
        x, _ = crowd_repulsion((distance, 0.0), (0.0, 0.0), {"strength": 2.1, "range": 0.3})
        assert x == pytest.approx(exact) or (x == 0.0 and exact < 0.01)
    assert x == 0.0


Segments = list[tuple[tuple[float, float], tuple[float, float]]]


def random_segments(rng: np.random.Generator) -> Segments:
    """Segments with lengths from 0 to 4 m in an area of random size, some of them equal."""
    count, area = int(rng.integers(0, 30)), rng.uniform(0.0, 8.0, 2)
    first = rng.uniform(0.0, 1.0, (count, 2)) * area
    second = first + rng.uniform(-2.0, 2.0, (count, 2)) * rng.integers(0, 2, (count, 2))
    pairs = np.stack([first, second], 1)
    return [((a, b), (c, d)) for (a, b), (c, d) in np.repeat(pairs, 2, 0)[count // 2 :].tolist()]


def distance_from(segment: tuple[tuple[float, float], tuple[float, float]], place: Any) -> float:
    a, b = np.array(segment)
    size = float(np.sum((b - a) ** 2))
    t = 0.0 if size == 0.0 else min(max(float(np.dot(place - a, b - a)) / size, 0.0), 1.0)
    return float(np.hypot(*(a + t * (b - a) - place)))


@pytest.mark.parametrize("seed", range(50))
def test_the_walls_near_a_place_are_all_walls_within_the_range(seed: int) -> None:
    rng = np.random.default_rng(seed)
    segments, reach = random_segments(rng), float(rng.uniform(0.1, 4.0))
    for _ in range(100):
        place = rng.uniform(-3.0, 11.0, 2)
        range_ = min(float(rng.uniform(0.0, 2.0)), 1.0) * reach
        distances = [distance_from(segment, place) for segment in segments]
        found, least = crowd_near_walls(segments, reach, place.tolist(), range_)
        assert found == pytest.approx([d for d in distances if d <= range_], abs=1e-12)
        assert least == pytest.approx(min([*distances, range_]), abs=1e-12)


def side_of(a: Any, b: Any, place: Any) -> float:
    return float((b[0] - a[0]) * (place[1] - a[1]) - (b[1] - a[1]) * (place[0] - a[0]))


def cross_each_other(a: Any, b: Any, c: Any, d: Any) -> bool:
    return side_of(a, b, c) * side_of(a, b, d) <= 0.0 and side_of(c, d, a) * side_of(c, d, b) <= 0.0


@pytest.mark.parametrize("seed", range(50))
def test_a_line_is_clear_if_no_wall_crosses_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    segments = random_segments(rng)
    for _ in range(20):
        a, b = rng.uniform(-2.0, 10.0, (2, 2)).tolist()
        is_crossed = any(cross_each_other(a, b, *segment) for segment in segments)
        assert crowd_is_clear(segments, a, b) == (not is_crossed)


@pytest.mark.parametrize("is_known", [crowd_is_hidden, crowd_is_in_view])
def test_lines_from_rectangles_are_clear_as_their_views_say(is_known: Any) -> None:
    known = 0
    for seed in range(400):
        rng = np.random.default_rng(seed)
        segments = random_segments(rng)
        place, low = rng.uniform(0.0, 8.0, (2, 2))
        high = low + rng.uniform(0.0, 1.0, 2)
        if not is_known(segments, place.tolist(), low.tolist(), high.tolist()):
            continue
        known += 1
        for point in (low + rng.uniform(0.0, 1.0, (50, 2)) * (high - low)).tolist():
            is_clear = crowd_is_clear(segments, point, place.tolist())
            assert is_clear == (is_known is crowd_is_in_view)
    assert known > 30


def test_a_wall_hides_a_place_if_it_covers_all_lines_to_it() -> None:
    wall: Segments = [((1.0, -3.0), (1.0, 3.0))]
    assert crowd_is_hidden(wall, (0.0, 0.0), (2.0, -1.0), (3.0, 1.0))
    assert not crowd_is_hidden(wall, (0.0, 0.0), (2.0, -1.0), (3.0, 9.5))  # not from a corner


@pytest.mark.parametrize(
    ("wall", "is_in_view"),
    [
        (((1.0, 0.52), (1.0, 3.0)), True),  # beside the line to a corner
        (((1.0, 0.48), (1.0, 3.0)), False),
        (((0.0, 1.1), (4.0, 1.1)), True),  # beyond a side
        (((2.4, -0.2), (2.6, 0.2)), False),  # inside of the rectangle
        (((2.5, 1.6), (3.6, 0.5)), True),  # in the bounding box of a corner, but not at the corner
        (((2.5, 1.4), (3.4, 0.5)), False),
        (((-0.5, -1.0), (-0.5, 1.0)), True),  # behind the place
        (((-1.0, 0.0), (0.0, 0.0)), False),  # up to the place
        (((1.0, 0.0), (1.0, 0.0)), False),  # a point
    ],
)
def test_a_place_is_in_view_if_no_wall_is_in_the_hull(wall: Any, is_in_view: bool) -> None:
    # The hull of (0, 0) and of the rectangle: its upper side passes (1, 0.5) and (2, 1).
    far = ((50.0, 50.0), (51.0, 50.0))
    assert crowd_is_in_view([far, wall], (0.0, 0.0), (2.0, -1.0), (3.0, 1.0)) == is_in_view


def test_the_doors_near_a_place_contain_all_that_are_visible() -> None:
    visible = in_view = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        segments = random_segments(rng)
        places = rng.uniform(-4.0, 12.0, (200, 2))
        doors, *lists = crowd_doors(segments, places.tolist())
        for place, seen, further in zip(places, *lists, strict=True):
            assert seen == sorted(set(seen))
            assert further == sorted(set(further) - set(seen))
            for index, door in enumerate(doors):
                if np.hypot(*(place - door)) > 4.0:
                    continue
                is_visible = crowd_is_clear(segments, place, door)
                assert is_visible or index not in seen
                assert not is_visible or index in seen + further
                visible += is_visible
                in_view += index in seen
    assert visible > 1000
    assert in_view > visible / 4


def test_two_discs_share_the_change_of_velocity_that_avoids_a_head_on_collision() -> None:
    # Both move at 1 m/s; the gap of 3 m lasts for the horizon of 2 s at a relative speed of 1.5.
    left = ((0.0, 0.0), (1.0, 0.0), 0.5)
    right = ((4.0, 0.0), (-1.0, 0.0), 0.5)
    normal, offset = crowd_avoid(left, right, horizon=2.0, share=0.5, dt=0.05)
    mirrored_normal, mirrored_offset = crowd_avoid(right, left, horizon=2.0, share=0.5, dt=0.05)
    # The nearest velocity outside the cone touches its side, at asin(r / d) from its axis.
    half_angle = math.asin(1.0 / 4.0)
    assert abs(normal[1]) == pytest.approx(math.cos(half_angle))
    assert normal[0] == pytest.approx(-math.sin(half_angle))
    change = 2.0 * math.sin(half_angle)  # of the relative velocity, which lies on the axis
    assert offset == pytest.approx(normal[0] * 1.0 + change / 2)
    # Point-symmetric: both move to their right, or both to their left.
    assert mirrored_normal == pytest.approx((-normal[0], -normal[1]))
    assert mirrored_offset == pytest.approx(offset)


def test_discs_that_stand_apart_need_no_change() -> None:
    normal, offset = crowd_avoid(
        ((0.0, 0.0), (0.0, 0.0), 0.2), ((2.0, 0.0), (0.0, 0.0), 0.2), horizon=2.0, share=0.5, dt=0.1
    )
    # At rest, half of the gap may be closed within the horizon.
    assert normal == (-1.0, 0.0)
    assert offset == pytest.approx(-(1.6 / 2.0) / 2)


def test_the_nearest_point_of_half_planes_is_that_of_an_exhaustive_search() -> None:
    rng = np.random.default_rng(4)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 101)] * 2), axis=-1).reshape(-1, 2)
    grid = grid[np.hypot(*grid.T) <= 1.0]
    feasible = 0
    for _ in range(60):
        angles = rng.uniform(0, 2 * np.pi, 4)
        normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        offsets = rng.uniform(-0.6, 0.3, 4)
        planes = [
            ((float(n[0]), float(n[1])), float(o)) for n, o in zip(normals, offsets, strict=True)
        ]
        preferred = rng.uniform(-1, 1, 2)
        found = np.array(nearest_point(planes, (preferred[0], preferred[1]), radius=1.0))
        assert np.hypot(*found) <= 1.0 + 1e-9
        slack = grid @ normals.T - offsets
        inside = grid[(slack >= 0).all(axis=1)]
        if len(inside):
            feasible += 1
            assert (normals @ found >= offsets - 1e-9).all()
            best = np.hypot(*(inside - preferred).T).min()
            assert np.hypot(*(found - preferred)) <= best + 1e-9
        else:  # the greatest violation is minimal
            assert (offsets - normals @ found).max() <= (-slack).max(axis=1).min() + 1e-9
    assert 10 < feasible < 60


def test_a_standing_leg_does_not_move_over_the_ground() -> None:
    speed, length = 1.34, step_length(1.34)
    assert length == pytest.approx(0.64, abs=0.01)
    for phase in np.linspace(0.0, 0.49, 20):  # the left leg stands
        walked = 2.0 * length * phase
        assert walked + leg_offset(phase, speed) == pytest.approx(length / 2)
    assert leg_offset(0.75, speed) == pytest.approx(0.0)  # it swings
    assert leg_offset(0.3, 0.0) == 0.0
