"""Poses and markers of the interactive marker of a model."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("visualization_msgs", reason="ROS is not installed")

from geometry_msgs.msg import Point, Pose, Quaternion

from flatland.node.adapters.receivers import planar_pose
from flatland.ros.interactive.model_handle import model_handle, pose_message

NAN, INF = math.nan, math.inf


def pose(x: float, y: float, z: float, *quaternion: float) -> Pose:
    return Pose(Point(x, y, z), Quaternion(*quaternion))


@pytest.mark.parametrize("theta", [0.0, 1.0, -3.0, math.pi / 2])
def test_pose_round_trip(theta: float) -> None:
    assert planar_pose(pose_message((1.0, -2.0, theta))) == pytest.approx((1, -2, theta))


def test_height_and_norm_of_the_quaternion_are_ignored() -> None:
    assert planar_pose(pose(1, 2, 9, 0, 0, 3, 3)) == pytest.approx((1, 2, math.pi / 2))


def test_heading_of_a_tilted_pose() -> None:
    # Yaw of 30 degrees, then pitch of 60 degrees, which does not change the heading.
    half_z, half_y = math.pi / 12, math.pi / 6
    tilted = (
        -math.sin(half_z) * math.sin(half_y),
        math.cos(half_z) * math.sin(half_y),
        math.sin(half_z) * math.cos(half_y),
        math.cos(half_z) * math.cos(half_y),
    )
    assert planar_pose(pose(0, 0, 0, *tilted)) == pytest.approx((0, 0, math.pi / 6))


@pytest.mark.parametrize(
    "numbers",
    [
        (NAN, 0, 0, 0, 0, 0, 1),
        (0, INF, 0, 0, 0, 0, 1),
        (0, 0, NAN, 0, 0, 0, 1),
        (0, 0, 0, 0, 0, NAN, 1),
        (0, 0, 0, 0, 0, 0, -INF),
        (0, 0, 0, 0, 0, 0, 0),
    ],
)
def test_invalid_pose(numbers: tuple[float, ...]) -> None:
    assert planar_pose(pose(*numbers)) is None


def test_outline_is_in_the_frame_of_the_first_body(load_model: Callable[[str], Any]) -> None:
    model = load_model("""
bodies:
  - {name: base, pose: [1, 0, 1], footprints: [{type: circle, radius: 0.5, density: 1}]}
  - {name: arm, pose: [4, 0, 1], color: [1, 0, 0, 1], footprints: [
     {type: polygon, points: [[0, 0], [1, 0], [0, 1]], density: 1},
     {type: circle, radius: 0.1, density: 1}]}
  - {name: empty, footprints: []}
""")
    marker = model_handle(model, "a name")
    text, base, arm = marker.controls[2].markers
    assert text.text == "a name"
    assert planar_pose(base.pose) == pytest.approx((0, 0, 0))
    assert planar_pose(arm.pose) == pytest.approx((3 * math.cos(1), -3 * math.sin(1), 0), abs=1e-6)
    assert (arm.color.r, arm.color.g, arm.color.b, arm.color.a) == (1, 0, 0, 1)
    radii = [math.hypot(point.x, point.y) for point in base.points]
    assert radii == pytest.approx([0.5] * len(radii))
    corners = np.array([(point.x, point.y) for point in arm.points[:6]])
    assert sorted({tuple(corner) for corner in corners}) == [(0, 0), (0, 1), (1, 0)]
    assert len(arm.points) > 6
    # The ring encloses the whole model.
    assert marker.scale == pytest.approx(2 * (3 + 1))


def test_minimum_size_of_the_ring(load_model: Callable[[str], Any]) -> None:
    model = load_model("bodies: [{name: base, footprints: []}]\n")
    marker = model_handle(model, "robot")
    assert marker.scale == 1.0
    assert len(marker.controls[2].markers) == 1


def test_only_the_outline_is_visible_with_every_tool(load_model: Callable[[str], Any]) -> None:
    marker = model_handle(load_model("bodies: [{name: base, footprints: []}]\n"), "robot")
    assert [control.always_visible for control in marker.controls] == [False, False, True]


@pytest.fixture
def load_model(files: Any) -> Callable[[str], Any]:
    return lambda text: files.load_model(text).model("robot")
