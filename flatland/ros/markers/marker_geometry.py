"""Turns edges, footprints and joints into the points of markers; whole arrays, no ROS."""

from __future__ import annotations

import math
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from flatland.geometry import Pose, compose

Points = npt.NDArray[np.float64]
"""Points (x, y, z) [m], shape (n, 3)."""

CIRCLE_HEIGHT: Final = 0.01  # m; a circle lies just above the lines around it
_CIRCLE_CORNERS: Final = 32


class Footprint(Protocol):
    """What is drawn of a fixture; `PhysicsFixture` is one."""

    @property
    def shape(self) -> str:
        """`circle`, `polygon` or `edge`."""

    @property
    def vertices(self) -> Points:
        """Corners in the body's frame [m], shape (n, 2)."""

    @property
    def center(self) -> tuple[float, float]:
        """Centre of a circle in the body's frame [m]."""

    @property
    def radius(self) -> float:
        """Radius of a circle [m]."""


def flat(points: npt.ArrayLike, z: float = 0.0) -> Points:
    """Puts points of the plane, shape (n, 2), at a height [m]."""
    plane = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    result = np.full((len(plane), 3), z)
    result[:, :2] = plane
    return result


def edge_lines(edges: npt.NDArray[np.float32]) -> Points:
    """Lists the two ends of each edge.

    Args:
        edges: (x1, y1, x2, y2) [m], shape (n, 4).

    Returns:
        Shape (2 n, 3), two points a line, at height 0.
    """
    return flat(edges)


def wall_triangles(edges: npt.NDArray[np.float32], min_z: float, max_z: float) -> Points:
    """Stands a wall on each edge.

    Args:
        edges: (x1, y1, x2, y2) [m], shape (n, 4).
        min_z: Where the walls begin [m].
        max_z: Where they end [m].

    Returns:
        Shape (6 n, 3): two triangles a wall.
    """
    triangles = np.empty((len(edges), 6, 3))
    for corner, (end, z) in enumerate(
        ((0, min_z), (2, min_z), (2, max_z), (0, min_z), (2, max_z), (0, max_z))
    ):
        triangles[:, corner, :2] = edges[:, end : end + 2]
        triangles[:, corner, 2] = z
    return triangles.reshape(-1, 3)


def closed_strip(vertices: npt.ArrayLike) -> Points:
    """Lists the corners of a polygon, shape (n, 2), and the first one again at the end."""
    corners = flat(vertices)
    strip: Points = np.concatenate((corners, corners[:1]))
    return strip


def outline(footprint: Footprint) -> Points:
    """Draws around a footprint; shape (2 n, 3), two points a line, in the body's frame."""
    if footprint.shape == "edge":
        return flat(footprint.vertices)
    if footprint.shape == "circle":
        angles = np.linspace(0.0, 2.0 * math.pi, _CIRCLE_CORNERS, endpoint=False)
        corners = np.stack((np.cos(angles), np.sin(angles)), axis=1)
        strip = closed_strip(footprint.center + footprint.radius * corners)
    else:
        strip = closed_strip(footprint.vertices)
    lines: Points = np.stack((strip[:-1], strip[1:]), axis=1)
    return lines.reshape(-1, 3)


def joint_points(
    pose_a: Pose,
    pose_b: Pose,
    anchors: npt.NDArray[np.float64],
) -> Points:
    """Lists the points of a joint.

    Args:
        pose_a: Of body A in the world frame.
        pose_b: Of body B in the world frame.
        anchors: Anchor of each body in its own frame [m], shape (2, 2).

    Returns:
        Origin of body A, anchor A, origin of body B, anchor B, in the world frame, shape (4, 3).
    """
    ends = [
        compose(pose, (*anchor, 0.0))
        for pose, anchor in zip((pose_a, pose_b), anchors, strict=True)
    ]
    return flat([pose[:2] for pose in (pose_a, ends[0], pose_b, ends[1])])


def joint_lines(points: Points) -> Points:
    """Connects the points of a joint: origin and anchor of each body, and the two anchors."""
    return points[[0, 1, 2, 3, 1, 3]]
