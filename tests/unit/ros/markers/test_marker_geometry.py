"""Conversion of edges, footprints and joints to points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from flatland.ros.markers.marker_geometry import (
    closed_strip,
    edge_lines,
    flat,
    joint_lines,
    joint_points,
    outline,
    wall_triangles,
)

EDGES = np.array([[0, 0, 2, 0], [1, 1, 1, 3]], np.float32)


@dataclass
class Shape:
    shape: str
    vertices: Any = ()
    center: tuple[float, float] = (0.0, 0.0)
    radius: float = 0.0


def test_flat() -> None:
    assert flat([(1, 2), (3, 4)], 0.5).tolist() == [[1, 2, 0.5], [3, 4, 0.5]]
    assert flat([]).shape == (0, 3)


def test_edge_lines() -> None:
    assert edge_lines(EDGES).tolist() == [[0, 0, 0], [2, 0, 0], [1, 1, 0], [1, 3, 0]]


def test_wall_triangles_cover_rectangles() -> None:
    triangles = wall_triangles(EDGES, 0.5, 2.5).reshape(-1, 3, 3)
    assert len(triangles) == 4
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    assert areas.tolist() == [2, 2, 2, 2]  # half of a wall, 2 m x 2 m
    for edge, wall in zip(EDGES, triangles.reshape(2, 6, 3), strict=True):
        corners = {tuple(corner) for corner in wall.tolist()}
        assert corners == {(x, y, z) for x, y in edge.reshape(2, 2).tolist() for z in (0.5, 2.5)}


def test_no_edges() -> None:
    edges = np.empty((0, 4), np.float32)
    assert edge_lines(edges).shape == (0, 3)
    assert wall_triangles(edges, 0, 1).shape == (0, 3)


def test_closed_strip() -> None:
    strip = closed_strip([(0, 0), (1, 0), (0, 1)])
    assert strip.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]]


def test_outline_of_a_polygon() -> None:
    lines = outline(Shape("polygon", [(0, 0), (1, 0), (0, 1)])).reshape(-1, 2, 3)
    assert lines[:, :, :2].tolist() == [[[0, 0], [1, 0]], [[1, 0], [0, 1]], [[0, 1], [0, 0]]]


def test_outline_of_an_edge() -> None:
    assert outline(Shape("edge", [(0, 0), (1, 0)])).tolist() == [[0, 0, 0], [1, 0, 0]]


def test_outline_of_a_circle() -> None:
    lines = outline(Shape("circle", center=(1.0, 2.0), radius=0.5)).reshape(-1, 2, 3)
    assert np.allclose(lines[:, 1], np.roll(lines[:, 0], -1, axis=0))
    distances = np.hypot(lines[..., 0] - 1, lines[..., 1] - 2)
    assert distances == pytest.approx(0.5)


def test_joint() -> None:
    points = joint_points((1, 2, math.pi / 2), (5, 5, 0), np.array([[1.0, 0.0], [0.5, 0.25]]))
    origin_a, anchor_a, origin_b, anchor_b = points.tolist()
    assert origin_a == [1, 2, 0]
    assert anchor_a == pytest.approx([1, 3, 0])
    assert origin_b == [5, 5, 0]
    assert anchor_b == [5.5, 5.25, 0]
    assert joint_lines(points).tolist() == [
        origin_a, anchor_a, origin_b, anchor_b, anchor_a, anchor_b,
    ]  # fmt: skip
