"""The place of a robot by the transforms of a time."""

from __future__ import annotations

import math
from types import SimpleNamespace as Message

import pytest

from flatland.scenarios.transforms import KEPT, TransformHistory
from flatland.values import Transform

SECOND = 10**9  # ns


def message(parent: str, child: str, seconds: float, x: float, yaw: float = 0.0) -> Message:
    """Returns a `tf2_msgs/TFMessage` in the form of ROS 2."""
    whole = int(seconds)
    stamp = Message(sec=whole, nanosec=round((seconds - whole) * SECOND))
    rotation = Message(x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    pose = Message(translation=Message(x=x, y=0.0, z=0.0), rotation=rotation)
    header = Message(frame_id=parent, stamp=stamp)
    return Message(transforms=[Message(header=header, child_frame_id=child, transform=pose)])


@pytest.fixture
def history() -> TransformHistory:
    """The odometry of a robot that drives at 1 m/s from 0 s to 2 s."""
    history = TransformHistory()
    for second in range(3):
        history.add([Transform(second * SECOND, "odom", "base", float(second), 0.0, 0.0)])
    return history


def test_a_chain_is_interpolated_but_not_extrapolated(history: TransformHistory) -> None:
    assert history.position("base", SECOND) is None  # No localisation yet.
    # The map turns by 90 degrees and moves by 1 m within a second.
    history.add_message(message("map", "odom", 0.5, 1.0))
    history.add_message(message("/map", "/odom", 1.5, 2.0, math.pi / 2))
    assert history.position("base", round(0.5 * SECOND)) == pytest.approx((1.5, 0.0))
    half = math.sqrt(0.5)
    assert history.position("base", SECOND) == pytest.approx((1.5 + half, half))
    assert history.position("base", round(1.5 * SECOND)) == pytest.approx((2.0, 1.5))
    for seconds in (0.4, 1.6):
        assert history.position("base", round(seconds * SECOND)) is None


def test_static_transforms_are_valid_at_all_times(history: TransformHistory) -> None:
    # The map need not be the root.
    history.add_message(message("odom", "map", 0.0, 0.25), is_static=True)
    assert history.position("base", round(1.75 * SECOND)) == pytest.approx((1.5, 0.0))


def test_repeated_late_invalid_and_cyclic_transforms(history: TransformHistory) -> None:
    history.add_message(message("map", "odom", 0.0, 0.0), is_static=True)
    history.add_message(message("odom", "base", 1.0, 9.0))  # The one before counts.
    history.add_message(message("odom", "base", 0.5, 0.75))
    history.add_message(message("odom", "base", 1.5, math.nan))
    for seconds, x in ((0.5, 0.75), (0.75, 0.875), (1.0, 1.0), (1.5, 1.5)):
        assert history.position("base", round(seconds * SECOND)) == pytest.approx((x, 0.0))
    history.add_message(message("base", "odom", 0.0, 0.0), is_static=True)
    assert history.position("base", SECOND) is None


def test_old_transforms_are_forgotten(history: TransformHistory) -> None:
    history.add_message(message("map", "odom", 0.0, 0.0), is_static=True)
    history.add([Transform(round((KEPT + 1.5) * SECOND), "odom", "base", 0.0, 0.0, 0.0)])
    assert history.position("base", SECOND) is None
    assert history.position("base", 2 * SECOND) == pytest.approx((2.0, 0.0))


def test_transforms_are_kept_for_long_periods(history: TransformHistory) -> None:
    history.add_message(message("map", "odom", 0.0, 0.0), is_static=True)
    history.keep_periods(10.0)
    history.add([Transform(12 * SECOND, "odom", "base", 12.0, 0.0, 0.0)])
    assert history.position("base", 2 * SECOND) == pytest.approx((2.0, 0.0))
    history.keep_periods(0.1)
    assert history.kept == KEPT
