"""Conversion of edges and footprints to points."""

from __future__ import annotations

import numpy as np

from flatland.node.markers.marker_geometry import closed_strip, flat, wall_triangles

EDGES = np.array([[0, 0, 2, 0], [1, 1, 1, 3]], np.float32)


def test_flat() -> None:
    assert flat([(1, 2), (3, 4)], 0.5).tolist() == [[1, 2, 0.5], [3, 4, 0.5]]
    assert flat([]).shape == (0, 3)


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
    assert wall_triangles(edges, 0, 1).shape == (0, 3)


def test_closed_strip() -> None:
    strip = closed_strip([(0, 0), (1, 0), (0, 1)])
    assert strip.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]]
