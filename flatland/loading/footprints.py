"""How the polygon of a footprint differs from its convex hull, which the physics uses."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np

from flatland.geometry import DoubleArray, Vector2

# Box2D welds points at a smaller distance; notches that are less deep have no effect.
_LEAST_DEPTH: Final = 0.0025  # m
_LEAST_SHARE: Final = 0.01  # of the extent, for small polygons


def hull_problem(body: str, points: Sequence[Vector2], outer: DoubleArray) -> str:
    """Returns what the physics makes of a polygon that is not convex.

    Args:
        body: Name of the body.
        points: Corners in the order in which they are joined [m].
        outer: Counter-clockwise corners of the convex hull [m], shape (n, 2).

    Returns:
        A text that follows "is", with the areas; empty for a convex polygon.
    """
    polygon = np.array(points, dtype=np.float64)
    area, hull_area = _area(polygon), _area(outer)
    tolerance = min(_LEAST_DEPTH, _LEAST_SHARE * float(np.ptp(polygon, axis=0).max()))
    perimeter = float(np.hypot(*_sides(outer).T).sum())
    if hull_area - area > tolerance * perimeter and _crosses_itself(polygon):
        return (
            f'a polygon of body "{body}" that crosses itself; the physics uses its convex '
            f"hull, with an area of {hull_area:.4g} m²: list the corners in the order of the "
            "outline"
        )
    if _depth(polygon, outer) > tolerance:
        return (
            f'concave in body "{body}"; the physics uses the convex hull, with an area of '
            f"{hull_area:.4g} m² instead of {area:.4g} m²: use several convex footprints"
        )
    return ""


def _sides(corners: DoubleArray) -> DoubleArray:
    sides: DoubleArray = np.roll(corners, -1, axis=0) - corners
    return sides


def _cross(a: DoubleArray, b: DoubleArray) -> DoubleArray:
    product: DoubleArray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def _area(corners: DoubleArray) -> float:
    relative = corners - corners[0]
    return abs(float(_cross(relative, np.roll(relative, -1, axis=0)).sum())) / 2


def _depth(points: DoubleArray, hull: DoubleArray) -> float:
    """Returns the greatest distance of a point from the border of the hull."""
    sides = _sides(hull)
    heights = _cross(sides, points[:, np.newaxis] - hull) / np.hypot(*sides.T)
    return float(heights.min(axis=1).max())


def _crosses_itself(corners: DoubleArray) -> bool:
    """Returns whether two sides that have no corner in common cross or touch each other."""
    n = len(corners)

    def is_between(i: int, j: int) -> bool:
        """Whether the ends of side j are on different sides of the line of side i, or on it."""
        start, along = corners[i], corners[(i + 1) % n] - corners[i]
        ends = corners[[j, (j + 1) % n]] - start
        first, second = _cross(along, ends).tolist()
        return bool(first * second <= 0 and (first or second))

    pairs = itertools.combinations(range(n), 2)
    apart = ((i, j) for i, j in pairs if 1 < j - i < n - 1)
    return any(is_between(i, j) and is_between(j, i) for i, j in apart)
