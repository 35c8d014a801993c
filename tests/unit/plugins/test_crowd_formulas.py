"""Formulas of the motion of people, and the solver of half-planes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flatland._core import (
    crowd_avoid,
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


def test_a_wall_repels_exponentially_with_the_distance_from_the_circumference() -> None:
    x, y = crowd_wall_repulsion((0.0, -0.5), 0.2, {"wall_strength": 5.0, "wall_range": 0.1})
    assert (x, y) == pytest.approx((0.0, -5.0 * math.exp(-3.0)))


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
