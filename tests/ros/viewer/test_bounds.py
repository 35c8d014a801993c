"""Bounding boxes of markers."""

from __future__ import annotations

import math
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from visualization_msgs.msg import Marker, MarkerArray

from flatland.viewer.bounds import Bounds, bounds_of, union


def marker(kind: int, points: list[tuple[float, float]], size: float = 0.03) -> Any:
    """A marker at (10, 20), rotated by 90 degrees."""
    rotated = Quaternion(0, 0, math.sqrt(0.5), math.sqrt(0.5))
    return Marker(
        type=kind,
        pose=Pose(Point(10, 20, 0), rotated),
        scale=Vector3(size, size, size),
        points=[Point(x, y, 0) for x, y in points],
    )


def limits(bounds: Bounds | None) -> Any:
    assert bounds is not None
    return pytest.approx((bounds.x_min, bounds.y_min, bounds.x_max, bounds.y_max))


def test_bounds_apply_the_pose_of_the_marker() -> None:
    lines = marker(Marker.LINE_LIST, [(0, 0), (2, 0), (2, 1), (0, 1)])
    assert limits(bounds_of(MarkerArray([lines]))) == (9, 20, 10, 22)


def test_bounds_of_circles_include_the_radius() -> None:
    circle = marker(Marker.SPHERE_LIST, [(1, 0)], size=4.0)
    assert limits(bounds_of(MarkerArray([circle]))) == (8, 19, 12, 23)
    lines = marker(Marker.LINE_LIST, [(0, 5), (0, -5)])
    assert limits(bounds_of(MarkerArray([circle, lines]))) == (5, 19, 15, 23)


def test_bounds_contain_all_markers() -> None:
    markers = [marker(Marker.LINE_LIST, points) for points in ([], [(0, 0), (2, 1)], [(10, -1)])]
    bounds = bounds_of(MarkerArray(markers))
    assert limits(bounds) == (9, 20, 11, 30)
    assert bounds is not None
    assert bounds.center == pytest.approx((10, 25))
    assert bounds.size == pytest.approx((2, 10))
    assert union([bounds, Bounds(0, 0, 1, 1)]) == Bounds(0, 0, bounds.x_max, bounds.y_max)


def test_markers_without_points_have_no_bounds() -> None:
    assert bounds_of(MarkerArray([marker(Marker.LINE_LIST, [])])) is None


def test_expanded() -> None:
    assert Bounds(0, 1, 2, 3).expanded(0.5) == Bounds(-0.5, 0.5, 2.5, 3.5)
