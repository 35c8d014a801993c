"""Conversion of edges, footprints and joints to marker points, as arrays and without ROS."""

from __future__ import annotations

from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from flatland.geometry import DoubleArray, Pose, circle_points, compose

"""DoubleArray (x, y, z) [m], shape (n, 3)."""

CIRCLE_HEIGHT: Final = 0.01  # m; slightly above lines
_CIRCLE_POINTS: Final = 32


class Footprint(Protocol):
    """Shape of a fixture; a protocol of `PhysicsFixture`."""

    @property
    def shape(self) -> str:
        """`circle`, `polygon` or `edge`."""

    @property
    def vertices(self) -> DoubleArray:
        """Vertices in the body frame [m], shape (n, 2)."""

    @property
    def center(self) -> tuple[float, float]:
        """Centre of a circle in the body frame [m]."""

    @property
    def radius(self) -> float:
        """Radius of a circle [m]."""


def flat(points: npt.ArrayLike, z: float = 0.0) -> DoubleArray:
    """Adds a z coordinate to planar points.

    Args:
        points: (x, y) [m], shape (n, 2).
        z: Height [m].
    """
    plane = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    result = np.full((len(plane), 3), z)
    result[:, :2] = plane
    return result


def edge_lines(edges: npt.NDArray[np.float32]) -> DoubleArray:
    """Converts edges to the points of a line list.

    Args:
        edges: (x1, y1, x2, y2) [m], shape (n, 4).

    Returns:
        DoubleArray at height 0, shape (2 n, 3), two per line.
    """
    return flat(edges)


def wall_triangles(edges: npt.NDArray[np.float32], min_z: float, max_z: float) -> DoubleArray:
    """Converts edges to the points of a triangle list that forms vertical walls.

    Args:
        edges: (x1, y1, x2, y2) [m], shape (n, 4).
        min_z: Lower end of the walls [m].
        max_z: Upper end of the walls [m].

    Returns:
        DoubleArray of two triangles per wall, shape (6 n, 3).
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


def outline(footprint: Footprint) -> DoubleArray:
    """Returns the outline of a footprint as a line list in the body frame, shape (2 n, 3)."""
    if footprint.shape == "edge":
        return flat(footprint.vertices)
    if footprint.shape == "circle":
        strip = closed_strip(circle_points(footprint.center, footprint.radius, _CIRCLE_POINTS))
    else:
        strip = closed_strip(footprint.vertices)
    lines: DoubleArray = np.stack((strip[:-1], strip[1:]), axis=1)
    return lines.reshape(-1, 3)


def joint_points(
    pose_a: Pose,
    pose_b: Pose,
    anchors: npt.NDArray[np.float64],
) -> DoubleArray:
    """Returns the points of a joint.

    Args:
        pose_a: Pose of body A in the world frame.
        pose_b: Pose of body B in the world frame.
        anchors: Anchor of each body in the body frame [m], shape (2, 2).

    Returns:
        Origin of body A, anchor A, origin of body B, anchor B, in the world frame, shape (4, 3).
    """
    ends = [
        compose(pose, (*anchor, 0.0))
        for pose, anchor in zip((pose_a, pose_b), anchors, strict=True)
    ]
    return flat([pose[:2] for pose in (pose_a, ends[0], pose_b, ends[1])])


def joint_lines(points: DoubleArray) -> DoubleArray:
    """Converts the points of a joint to a line list: origins to anchors, and anchor to anchor."""
    return points[[0, 1, 2, 3, 1, 3]]
