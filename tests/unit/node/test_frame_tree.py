"""Transforms between frames."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flatland.geometry import quaternion_from_yaw
from flatland.node.frame_tree import FrameTree, NoTransformError, transform


def planar(x: float, y: float, yaw: float) -> np.ndarray:
    return transform((x, y, 0), quaternion_from_yaw(yaw))


def test_a_frame_is_transformed_along_its_parents() -> None:
    frames = FrameTree("map")
    frames.set("/map", "odom", planar(1, 2, math.pi / 2))
    frames.set("odom", "/base", planar(3, 0, 0))
    np.testing.assert_allclose(frames.to_root("base"), planar(1, 5, math.pi / 2), atol=1e-12)
    np.testing.assert_allclose(frames.to_root("/map"), np.eye(4))
    frames.set("map", "odom", planar(0, 0, 0))
    np.testing.assert_allclose(frames.to_root("base"), planar(3, 0, 0), atol=1e-12)


def test_the_root_may_have_parents_and_siblings() -> None:
    frames = FrameTree("map")
    frames.set("earth", "map", planar(10, 0, math.pi))
    frames.set("earth", "dock", planar(11, 0, 0))
    np.testing.assert_allclose(frames.to_root("dock"), planar(-1, 0, math.pi), atol=1e-12)
    np.testing.assert_allclose(frames.to_root("map"), np.eye(4), atol=1e-12)


def test_missing_transforms_and_loops_are_errors_that_name_both_frames() -> None:
    frames = FrameTree("map")
    frames.set("a", "b", planar(1, 0, 0))
    frames.set("b", "a", planar(1, 0, 0))
    for frame in ("odom", "a"):
        with pytest.raises(NoTransformError, match=f'^no transform from "{frame}" to "map"$'):
            frames.to_root(frame)
    with pytest.raises(NoTransformError, match="names no frame"):
        frames.to_root("")


def test_invalid_transforms_are_ignored() -> None:
    frames = FrameTree("map")
    frames.set("map", "odom", planar(1, 0, 0))
    frames.set("map", "odom", planar(math.nan, 0, 0))
    frames.set("map", "odom", transform((0, 0, 0), (0, 0, math.inf, 1)))
    assert frames.to_root("odom")[0, 3] == 1


def test_the_number_of_frames_is_limited() -> None:
    frames = FrameTree("map")
    for number in range(10_001):
        frames.set("map", str(number), planar(1, 0, 0))
    frames.set("map", "9999", planar(2, 0, 0))
    assert frames.to_root("9999")[0, 3] == 2
    with pytest.raises(NoTransformError):
        frames.to_root("10000")


def test_a_quaternion_is_normalized_and_zero_is_no_rotation() -> None:
    np.testing.assert_allclose(
        transform((0, 0, 0), (0, 0, 2, 2)), planar(0, 0, math.pi / 2), atol=1e-12
    )
    np.testing.assert_array_equal(transform((0, 0, 0), (0, 0, 0, 0)), np.eye(4))
    about_x = transform((0, 0, 0), (math.sqrt(0.5), 0, 0, math.sqrt(0.5)))
    np.testing.assert_allclose(about_x[:3, :3] @ (0, 1, 0), (0, 0, 1), atol=1e-12)
