"""Planar poses: composition, inversion and checks.

A pose is `(x, y, theta)` in [m], [m], [rad], x forward, y left, counter-clockwise (REP 103).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Pose = tuple[float, float, float]
Vector2 = tuple[float, float]
FloatArray = npt.NDArray[np.float32]
DoubleArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

IDENTITY: Pose = (0.0, 0.0, 0.0)


def compose(outer: Sequence[float], inner: Sequence[float]) -> Pose:
    """Expresses a pose given in the frame of another pose in that other pose's parent.

    Args:
        outer: Pose of frame B in frame A.
        inner: Pose of frame C in frame B.

    Returns:
        Pose of frame C in frame A; angles add and are not wrapped.
    """
    x, y, theta = outer
    c, s = math.cos(theta), math.sin(theta)
    return (x + c * inner[0] - s * inner[1], y + s * inner[0] + c * inner[1], theta + inner[2])


def invert(pose: Sequence[float]) -> Pose:
    """Gives the pose of frame A in frame B from the pose of frame B in frame A."""
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    return (-c * x - s * y, s * x - c * y, -theta)


def rotate(vector: Sequence[float], theta: float) -> Vector2:
    """Turns a vector counter-clockwise by `theta` [rad]."""
    c, s = math.cos(theta), math.sin(theta)
    return (c * vector[0] - s * vector[1], s * vector[0] + c * vector[1])


def wrap_angle(theta: float) -> float:
    """Brings an angle [rad] to the range [-pi, pi]."""
    return math.remainder(theta, math.tau)


def finite_pose(pose: Sequence[float]) -> Pose:
    """Converts to a pose of three finite floats.

    Raises:
        ValueError: There are not three numbers, or one is NaN or infinite.
    """
    try:
        x, y, theta = (float(number) for number in pose)
    except (TypeError, ValueError):
        raise ValueError(f"pose must be three numbers (x, y, theta), got {pose!r}") from None
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(theta)):
        raise ValueError(f"pose must be finite, got ({x}, {y}, {theta})")
    return (x, y, theta)
