"""Stamps in wall time, with a fake wall clock."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

from flatland.ros.adapters import convert
from flatland.ros.clock import WallClock

START = 1_700_000_000_000_000_000  # ns
STEP = 5_000_000  # ns
MS = 1_000_000


class Wall:
    """The wall time, and a clock that uses it."""

    def __init__(self) -> None:
        self.now = START
        self.clock = WallClock(lambda: self.now)
        self.time = 0

    def step(self, until_advance: int = 2 * MS, rest: int = 3 * MS) -> tuple[int, int]:
        """Steps; returns the stamps of the times before and after the step."""
        self.clock.step_started(self.time)
        before = convert.stamp(self.time)
        self.now += until_advance
        self.time += STEP
        self.clock.time_advanced(self.time)
        # Transforms are converted at the end of the step.
        assert convert.stamp(self.time - STEP) == before
        after = convert.stamp(self.time)
        self.now += rest
        return before, after


@pytest.fixture
def wall() -> Iterator[Wall]:
    wall = Wall()
    yield wall
    wall.clock.close()
    assert convert.stamp(STEP) == STEP


def test_stamps_are_the_wall_times_at_which_times_are_reached(wall: Wall) -> None:
    assert wall.step() == (START, START + 2 * MS)
    assert wall.step() == (START + 2 * MS, START + 7 * MS)
    header = convert.header(wall.time, "map")
    assert header.stamp.to_nsec() == START + 7 * MS
    assert convert.time(wall.time - STEP).to_nsec() == START + 2 * MS


@pytest.mark.parametrize("rest", [0, 3 * MS, 90 * MS, 101 * MS, 2000 * MS])
def test_stamps_increase_are_not_in_the_future_and_close_to_the_current_time(
    wall: Wall, rest: int
) -> None:
    stamps = []
    for _ in range(20):
        start = wall.now
        before, after = wall.step(rest=rest)
        assert start - 100 * MS <= before <= start
        assert after == wall.now - rest
        stamps += [before, after]
    assert stamps == sorted(stamps)
    assert len(set(stamps)) > 20


def test_stamps_increase_although_the_clock_stands_still_or_is_corrected(wall: Wall) -> None:
    wall.step()
    stamps = [wall.step(until_advance=0, rest=0)[1] for _ in range(3)]
    wall.now -= 10 * MS
    stamps += [wall.step(until_advance=0, rest=0)[1] for _ in range(3)]
    assert stamps == sorted(set(stamps))


def test_stamps_follow_a_clock_that_is_set_back(wall: Wall) -> None:
    wall.step()
    wall.now -= 3_600_000 * MS
    before, after = wall.step(rest=0)
    assert before == wall.now - 2 * MS
    assert after == wall.now


def test_other_times_are_stamped_relative_to_the_last_ones(wall: Wall) -> None:
    wall.step()
    before, after = wall.step(rest=0)
    assert convert.stamp(wall.time + 40 * MS) == after + 40 * MS
    assert convert.stamp(wall.time - STEP + 1) == before + 1
    assert convert.stamp(wall.time - STEP - 7) == before - 7
