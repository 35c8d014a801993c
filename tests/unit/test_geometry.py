"""Poses in the plane."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flatland.geometry import compose, finite_pose, invert, rotate, wrap_angle

numbers = st.floats(-1e3, 1e3)
poses = st.tuples(numbers, numbers, st.floats(-10, 10))


def test_compose_turns_the_inner_position():
    assert compose((1, 2, math.pi / 2), (3, 0, 0.5)) == pytest.approx((1, 5, math.pi / 2 + 0.5))
    assert rotate((1, 0), math.pi / 2) == pytest.approx((0, 1))


@given(poses, poses)
def test_invert_undoes_compose(outer, inner):
    assert compose(invert(outer), compose(outer, inner)) == pytest.approx(inner, abs=1e-9)


@given(st.floats(-1e6, 1e6))
def test_wrap_angle_keeps_the_direction(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)


@pytest.mark.parametrize(
    "pose", [(1, 2), "abc", None, (1, 2, "x"), (1, 2, math.nan), (1, math.inf, 0)]
)
def test_finite_pose_refuses(pose):
    with pytest.raises(ValueError, match="pose must be"):
        finite_pose(pose)


def test_finite_pose_takes_any_sequence():
    assert finite_pose(["1", 2, 3.5]) == (1.0, 2.0, 3.5)
