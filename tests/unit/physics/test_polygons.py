"""The convex hulls of polygons, also of those with points on or almost on an edge."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from flatland.physics import PhysicsBody, PhysicsWorld

Points = npt.NDArray[Any]

WELD = np.float32(0.0025) ** 2  # m²; Box2D drops points at a smaller distance from an earlier one


@pytest.fixture
def world() -> PhysicsWorld:
    return PhysicsWorld()


@pytest.fixture
def body(world: PhysicsWorld) -> PhysicsBody:
    return world.create_body("dynamic", (0, 0, 0))


def hull_of_box2d(points: Points) -> Points:
    """Returns the hull of b2PolygonShape::Set, in single precision; empty if it does not end."""
    kept: list[Any] = []
    for point in points.astype(np.float32):
        if all(((point - other) ** 2).sum() >= WELD for other in kept):
            kept.append(point)
    at = start = min(range(len(kept)), key=lambda i: (-kept[i][0], kept[i][1]))
    hull: list[Any] = []
    while len(hull) < 8:
        hull.append(kept[at])
        following = 0
        for i in range(1, len(kept)):
            r, v = kept[following] - kept[at], kept[i] - kept[at]
            turn = r[0] * v[1] - r[1] * v[0]
            is_farther = (v**2).sum() > (r**2).sum()
            if following == at or turn < 0 or (turn == 0 and is_farther):
                following = i
        at = following
        if at == start:
            return np.array(hull)
    return np.empty((0, 2), np.float32)


def area_of(corners: Points) -> float:
    """Returns the area of a polygon in double precision."""
    x, y = corners.astype(np.float64).T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


def rectangles(count: int, seed: int) -> list[tuple[Points, float]]:
    """Returns turned rectangles with a point on a side, with 7 decimals, and their areas."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        half = rng.uniform(0.3, 3.0, 2)
        corners: Points = half * [[1, -1], [1, 1], [-1, 1], [-1, -1]]
        side = rng.integers(4)
        share = rng.uniform(0.02, 0.98)
        between = (1 - share) * corners[side] + share * corners[(side + 1) % 4]
        outline = np.insert(corners, side + 1, between, axis=0)
        angle = rng.uniform(0, math.tau)
        c, s = math.cos(angle), math.sin(angle)
        points = np.round(outline @ [[c, s], [-s, c]] + rng.uniform(-3, 3, 2), 7)
        made.append((np.roll(points, rng.integers(5), axis=0), 4 * half[0] * half[1]))
    return made


def test_ordinary_hulls_are_those_of_box2d_bit_by_bit(world: PhysicsWorld) -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        points = rng.normal(0, 10 ** rng.uniform(-1, 2), (rng.integers(3, 9), 2))
        points = np.round(points + rng.normal(0, 1, 2), int(rng.integers(1, 8)))
        expected = hull_of_box2d(points)
        if len(expected) < 3 or area_of(expected) < 1e-3:
            continue
        polygon = world.create_body("dynamic", (0, 0, 0)).create_polygon(points, density=1)
        np.testing.assert_array_equal(polygon.vertices, expected)


def test_a_point_almost_on_a_side_loses_no_corner(world: PhysicsWorld) -> None:
    lost = 0
    for points, area in rectangles(500, 1):
        found = hull_of_box2d(points)
        is_right = len(found) > 2 and area_of(found) == pytest.approx(area, rel=3e-6)
        lost += not is_right
        body = world.create_body("dynamic", (0, 0, 0))
        polygon = body.create_polygon(points, density=1)
        assert body.mass == pytest.approx(area, rel=1e-6)
        if is_right:
            np.testing.assert_array_equal(polygon.vertices, found)
        body.destroy()
    assert lost > 1  # by Box2D


def test_a_corner_is_not_welded_to_a_point_on_a_side(body: PhysicsBody) -> None:
    points = [(0.502, 0), (0, 0), (0.504, 0), (0.504, 0.3), (0, 0.3)]
    body.create_polygon(points, density=1)
    assert body.mass == pytest.approx(0.504 * 0.3, rel=1e-6)


def test_rays_and_discs_hit_the_corner_that_box2d_loses(world: PhysicsWorld) -> None:
    points, _ = next(
        (points, area)
        for points, area in rectangles(1000, 2)
        if len(found := hull_of_box2d(points)) > 2 and area_of(found) < 0.9 * area
    )
    body = world.create_body("static", (0, 0, 0))
    polygon = body.create_polygon(points, density=0)
    center = points.mean(axis=0)
    for corner in points:
        near = center + 0.98 * (corner - center)
        assert not world.free_discs([(*near, 0.0)], 0.001, 0xFFFF)[0]
    assert len(polygon.vertices) >= 4
    # The normals point outwards: a ray from outside hits each side in its middle.
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        middle = (a + b) / 2
        away = middle + 0.2 * (middle - center)
        fractions, _ = world.cast_rays((*away, 0.0), [2 * (middle - away)], 0xFFFF)
        assert fractions[0] == pytest.approx(0.5, abs=1e-5)
