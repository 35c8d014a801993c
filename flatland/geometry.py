"""Planar geometry: poses, points and quaternions.

A pose is a tuple `(x, y, theta)` in [m, m, rad] with x forward, y left and theta counter-clockwise
(REP 103).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from flatland.checks import plain_numbers, shown

Pose = tuple[float, float, float]
Vector2 = tuple[float, float]
Bounds = tuple[float, float, float, float]
"""An axis-aligned rectangle (x_min, y_min, x_max, y_max) [m]."""
FloatArray = npt.NDArray[np.float32]
DoubleArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

MAX_MAGNITUDE = 1e9
"""Largest magnitude of the numbers that the physics accepts."""

IDENTITY: Pose = (0.0, 0.0, 0.0)
"""The pose of a frame in itself."""


def compose(outer: Sequence[float], inner: Sequence[float]) -> Pose:
    """Returns the pose of frame C in frame A from the poses of C in B and of B in A.

    Args:
        outer: Pose of frame B in frame A.
        inner: Pose of frame C in frame B.

    Returns:
        Pose of frame C in frame A; the angles are added and not wrapped.
    """
    x, y, theta = outer
    c, s = math.cos(theta), math.sin(theta)
    return (x + c * inner[0] - s * inner[1], y + s * inner[0] + c * inner[1], theta + inner[2])


def invert(pose: Sequence[float]) -> Pose:
    """Returns the pose of frame A in frame B from the pose of frame B in frame A."""
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    return (-c * x - s * y, s * x - c * y, -theta)


def rotate(vector: Sequence[float], theta: float) -> Vector2:
    """Returns a vector rotated counter-clockwise by `theta` [rad]."""
    c, s = math.cos(theta), math.sin(theta)
    return (c * vector[0] - s * vector[1], s * vector[0] + c * vector[1])


def wrap_angle(theta: float) -> float:
    """Returns the equivalent angle in [-pi, pi] [rad]."""
    return math.remainder(theta, math.tau)


def finite_pose(pose: Sequence[float], name: str = "pose") -> Pose:
    """Converts a sequence of three numbers to a pose.

    Args:
        pose: The numbers.
        name: Name of the pose, for the error.

    Raises:
        ValueError: The sequence does not consist of three numbers, or one is NaN or infinite.
    """
    numbers = plain_numbers(pose, (3,))
    if numbers is None:
        raise ValueError(f"{name} must be three numbers (x, y, theta), got {shown(pose)}")
    x, y, theta = numbers
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(theta)):
        raise ValueError(f"{name} must be finite, got ({x}, {y}, {theta})")
    return (x, y, theta)


def finite_place(name: str, place: Sequence[float]) -> Vector2:
    """Converts a sequence of two numbers to a place.

    Args:
        name: Name of the place, for the error.
        place: The numbers.

    Raises:
        ValueError: The sequence does not consist of two numbers, or one is NaN or infinite.
    """
    numbers = plain_numbers(place, (2,))
    if numbers is None or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name} must be two finite numbers (x, y), got {shown(place)}")
    return (numbers[0], numbers[1])


def transform_points(pose: Sequence[float], points: DoubleArray) -> DoubleArray:
    """Transforms points from a frame to the parent of the frame.

    Args:
        pose: Pose of the frame in the parent frame.
        points: Points in the frame [m], shape (..., 2).

    Returns:
        Points in the parent frame [m], same shape.
    """
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    transformed: DoubleArray = points @ np.array([[c, s], [-s, c]]) + np.array([x, y])
    return transformed


def bounds_of(points: DoubleArray) -> Bounds | None:
    """Returns the bounds of points, shape (n, 2), None if there are none."""
    if not len(points):
        return None
    (x_min, y_min), (x_max, y_max) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return (x_min, y_min, x_max, y_max)


def circle_points(center: Sequence[float], radius: float, count: int) -> DoubleArray:
    """Returns evenly spaced points on a circle.

    Args:
        center: Center of the circle [m].
        radius: Radius of the circle [m].
        count: Number of points.

    Returns:
        Points in counter-clockwise order, starting on the x axis [m], shape (count, 2).
    """
    angles = np.linspace(0.0, math.tau, count, endpoint=False)
    unit_circle = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    points: DoubleArray = np.asarray(center, np.float64) + radius * unit_circle
    return points


def quaternion_from_yaw(yaw: float, roll: float = 0.0) -> tuple[float, float, float, float]:
    """Returns the quaternion (x, y, z, w) of a rotation about x followed by one about z.

    Args:
        yaw: Angle about the z axis [rad].
        roll: Angle about the x axis, applied first [rad].
    """
    sin_yaw, cos_yaw = math.sin(yaw / 2), math.cos(yaw / 2)
    if roll == 0.0:
        return (0.0, 0.0, sin_yaw, cos_yaw)
    sin_roll, cos_roll = math.sin(roll / 2), math.cos(roll / 2)
    return (sin_roll * cos_yaw, sin_roll * sin_yaw, cos_roll * sin_yaw, cos_roll * cos_yaw)


def yaw_from_quaternion(x: float, y: float, z: float, w: float) -> float:
    """Returns the yaw [rad] of a rotation, that is, the heading of its x axis in the xy plane.

    Args:
        x: First component.
        y: Second component.
        z: Third component.
        w: Scalar component; the quaternion need not be normalized.
    """
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
