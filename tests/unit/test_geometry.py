"""Planar geometry."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flatland.geometry import (
    circle_points,
    compose,
    finite_pose,
    invert,
    quaternion_from_yaw,
    rotate,
    transform_points,
    wrap_angle,
    yaw_from_quaternion,
)

numbers = st.floats(-1e3, 1e3)
poses = st.tuples(numbers, numbers, st.floats(-10, 10))


def test_compose_rotates_the_inner_position():
    assert compose((1, 2, math.pi / 2), (3, 0, 0.5)) == pytest.approx((1, 5, math.pi / 2 + 0.5))
    assert rotate((1, 0), math.pi / 2) == pytest.approx((0, 1))


@given(poses, poses)
def test_invert_is_the_inverse_of_compose(outer, inner):
    assert compose(invert(outer), compose(outer, inner)) == pytest.approx(inner, abs=1e-9)


@given(st.floats(-1e6, 1e6))
def test_wrap_angle_preserves_the_direction(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)


@pytest.mark.parametrize(
    "pose",
    [
        (1, 2),
        "123",
        None,
        (1, 2, "3"),
        (1, 2, math.nan),
        (1, math.inf, 0),
        (10**400, 0, 0),
        (1j, 0, 0),
        (True, 0, 0),
        {1, 2, 3},
        np.eye(3),
    ],
)
def test_finite_pose_rejects_invalid_poses(pose):
    with pytest.raises(ValueError, match="pose must be"):
        finite_pose(pose)


def test_finite_pose_accepts_any_sequence():
    assert finite_pose([np.int64(1), 2, 3.5]) == finite_pose(np.array([1, 2, 3.5]))
    assert finite_pose(iter((Fraction(1, 2), 2, 3))) == (0.5, 2.0, 3.0)


@given(poses, st.lists(st.tuples(numbers, numbers), min_size=1, max_size=5))
def test_transform_points_agrees_with_compose(pose, points):
    transformed = transform_points(pose, np.array(points))
    expected = [compose(pose, (*point, 0.0))[:2] for point in points]
    assert transformed == pytest.approx(np.array(expected), abs=1e-9)


def test_transform_points_preserves_the_shape():
    assert transform_points((1, 2, 3), np.zeros(2)).shape == (2,)
    assert transform_points((1, 2, 3), np.zeros((4, 2, 2))).shape == (4, 2, 2)
    assert transform_points((1, 2, 3), np.zeros((0, 2))).shape == (0, 2)


def test_circle_points_are_evenly_spaced_and_counter_clockwise():
    points = circle_points((1, 2), 0.5, 4)
    assert points == pytest.approx(np.array([(1.5, 2), (1, 2.5), (0.5, 2), (1, 1.5)]))


def test_quaternion_from_yaw():
    assert quaternion_from_yaw(0.0) == (0, 0, 0, 1)
    half = math.sqrt(0.5)
    assert quaternion_from_yaw(math.pi / 2) == pytest.approx((0, 0, half, half))
    assert quaternion_from_yaw(0.0, math.pi / 2) == pytest.approx((half, 0, 0, half))
    assert quaternion_from_yaw(math.pi / 2, math.pi) == pytest.approx((half, half, 0, 0))


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(0.1, 10))
def test_yaw_from_quaternion_of_any_norm(yaw, roll, norm):
    quaternion = (norm * part for part in quaternion_from_yaw(yaw, roll))
    assert yaw_from_quaternion(*quaternion) == pytest.approx(yaw, abs=1e-9)
