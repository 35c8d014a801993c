"""Conversion of edges and footprints to marker points, as arrays and without ROS."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import DoubleArray

CIRCLE_HEIGHT: Final = 0.01  # m; slightly above lines


def flat(points: npt.ArrayLike, z: float = 0.0) -> DoubleArray:
    """Adds a z coordinate to planar points.

    Args:
        points: (x, y) [m], shape (n, 2).
        z: Height [m].

    Returns:
        Points (x, y, z) [m], shape (n, 3).
    """
    plane = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    result = np.full((len(plane), 3), z)
    result[:, :2] = plane
    return result


def wall_triangles(edges: npt.NDArray[np.float32], min_z: float, max_z: float) -> DoubleArray:
    """Converts edges to the points of a triangle list that forms vertical walls.

    Args:
        edges: (x1, y1, x2, y2) [m], shape (n, 4).
        min_z: Lower end of the walls [m].
        max_z: Upper end of the walls [m].

    Returns:
        Points of two triangles per wall, shape (6 n, 3).
    """
    triangles = np.empty((len(edges), 6, 3))
    for corner, (end, z) in enumerate(
        ((0, min_z), (2, min_z), (2, max_z), (0, min_z), (2, max_z), (0, max_z))
    ):
        triangles[:, corner, :2] = edges[:, end : end + 2]
        triangles[:, corner, 2] = z
    return triangles.reshape(-1, 3)


def closed_strip(vertices: npt.ArrayLike) -> DoubleArray:
    """Converts vertices of a polygon, shape (n, 2), to a closed line strip, shape (n + 1, 3)."""
    corners = flat(vertices)
    strip: DoubleArray = np.concatenate((corners, corners[:1]))
    return strip
