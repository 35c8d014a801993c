"""Shapes of paths, poses and polygons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from flatland.geometry import DoubleArray
from flatland.node.frame_tree import transform
from flatland.node.shapes import MAX_LINES, OWN_COLOR, Shapes, colors_of, limited

_POSE_LENGTH: Final = 0.7  # m
_POSE_SIZES: Final = (0.08, 0.24, 0.24)  # m
_POSES_LENGTH: Final = 0.3  # m, as in RViz
_POSES_SIZES: Final = (0.0, 0.08, 0.08)  # m


def points_of(points: Sequence[Any]) -> DoubleArray:
    """Returns points of messages as an array of shape (n, 3)."""
    return np.array([(p.x, p.y, p.z) for p in points], float).reshape(-1, 3)


def matrix_of(pose: Any) -> DoubleArray:
    """Returns the transform from the frame of a pose to its parent, shape (4, 4)."""
    p, q = pose.position, pose.orientation
    return transform((p.x, p.y, p.z), (q.x, q.y, q.z, q.w))


def path(message: Any) -> Shapes:
    """Returns the line through the poses of a `nav_msgs/Path`; a very long one is simplified."""
    poses = message.poses
    stride = len(poses) // MAX_LINES + 1
    kept = [*poses[:-1:stride], *poses[-1:]]
    points = points_of([each.pose.position for each in kept])
    return _strip(points)


def polygon(message: Any) -> Shapes:
    """Returns the outline of a `geometry_msgs/PolygonStamped`."""
    points = points_of(message.polygon.points[:MAX_LINES])
    return _strip(np.vstack((points, points[:1])))


def pose(message: Any) -> Shapes:
    """Returns the arrow of a message whose `pose` is a pose, with a covariance or without."""
    found = getattr(message.pose, "pose", message.pose)
    return _arrows([found], _POSE_LENGTH, _POSE_SIZES)


def poses(message: Any) -> Shapes:
    """Returns the arrows of a `geometry_msgs/PoseArray`."""
    return _arrows(message.poses[:MAX_LINES], _POSES_LENGTH, _POSES_SIZES)


def _strip(points: DoubleArray) -> Shapes:
    shapes = Shapes()
    count = max(len(points) - 1, 0)
    shapes.add_lines(points[:-1], points[1:], 0.0, colors_of(OWN_COLOR, count))
    return shapes


def _arrows(poses: Sequence[Any], length: float, sizes: Sequence[float]) -> Shapes:
    shapes = Shapes()
    starts = points_of([each.position for each in poses])
    # The first column of the matrix of a quaternion is the direction of the x axis.
    rotations = [(o.x, o.y, o.z, o.w) for o in (each.orientation for each in poses)]
    q = limited(rotations).reshape(-1, 4)
    x, y, z, w = q.T
    square = np.maximum((q * q).sum(axis=1), 1e-12)
    columns = (1 - 2 * (y * y + z * z) / square, 2 * (x * y + z * w), 2 * (x * z - y * w))
    along = np.column_stack((columns[0], columns[1] / square, columns[2] / square))
    shapes.add_arrows(starts, starts + length * along, sizes, colors_of(OWN_COLOR, len(starts)))
    return shapes
