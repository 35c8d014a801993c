"""The time of the node: stamps of wall time, with a fake wall clock, and simulated time."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
from waiting import TIMEOUT, wait_until

from flatland.node.clock import NodeClock, SimulatedClock, WallClock, stamp
from flatland.node.stamps import FIRST_TIME

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
        before = stamp(self.time)
        self.now += until_advance
        self.time += STEP
        self.clock.time_advanced(self.time)
        # Transforms are converted at the end of the step.
        assert stamp(self.time - STEP) == before
        after = stamp(self.time)
        self.now += rest
        return before, after


@pytest.fixture
def wall() -> Iterator[Wall]:
    wall = Wall()
    yield wall
    wall.clock.close()
    assert stamp(STEP) == STEP


def test_stamps_are_the_wall_times_at_which_times_are_reached(wall: Wall) -> None:
    assert wall.step() == (START, START + 2 * MS)
    assert wall.step() == (START + 2 * MS, START + 7 * MS)
    assert stamp(wall.time) == START + 7 * MS
    assert stamp(wall.time - STEP) == START + 2 * MS


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
    # By the least that is possible, to stay close to the clock.
    assert stamps == list(range(stamps[0], stamps[0] + 6))


def test_stamps_follow_a_clock_that_is_set_back(wall: Wall) -> None:
    wall.step()
    wall.now -= 3_600_000 * MS
    before, after = wall.step(rest=0)
    assert before == wall.now - 2 * MS
    assert after == wall.now


def test_other_times_are_stamped_relative_to_the_last_ones(wall: Wall) -> None:
    wall.step()
    before, after = wall.step(rest=0)
    assert stamp(wall.time + 40 * MS) == after + 40 * MS
    assert stamp(wall.time - STEP + 1) == before + 1
    assert stamp(wall.time - STEP - 7) == before - 7


@pytest.mark.parametrize(("back", "is_set_back"), [(100 * MS, False), (100 * MS + 1, True)])
def test_a_clock_is_corrected_by_the_largest_age_at_most(
    wall: Wall, back: int, is_set_back: bool
) -> None:
    wall.step(until_advance=0, rest=0)
    next_stamp = stamp(wall.time) + 1
    wall.now = next_stamp - back
    wall.time += STEP
    wall.clock.time_advanced(wall.time)
    assert stamp(wall.time) == (wall.now if is_set_back else next_stamp)


def test_the_stamp_of_a_step_is_renewed_after_the_largest_age(wall: Wall) -> None:
    wall.now += 100 * MS
    wall.clock.step_started(0)
    assert stamp(0) == START
    wall.now += 1
    wall.clock.step_started(0)
    assert stamp(0) == wall.now
    assert wall.clock.watches_steps is True
    assert wall.clock.watches_time is False


def test_a_clock_without_a_topic_needs_no_steps() -> None:
    clock = NodeClock()
    assert (clock.watches_steps, clock.watches_time) == (False, False)


# -- simulated time ---------------------------------------------------------------------------


def test_a_limited_clock_publishes_the_last_time(transport: Any) -> None:
    rate = 20.0
    clock = SimulatedClock(transport, rate)
    topic = transport.topics["/clock"]
    start = time.monotonic()
    try:
        topic.connect()
        for number in range(200):
            clock.time_advanced(number * STEP)
        wait_until("the last time", lambda: topic.sent[-1] == 199 * STEP)
        # Besides one message a period: two for the connection.
        assert len(topic.sent) <= 3 + (time.monotonic() - start) * rate
        assert topic.sent == sorted(topic.sent)
    finally:
        clock.close()
    assert transport.time_ns == 199 * STEP


def test_the_simulated_time_is_published_with_each_step(transport: Any) -> None:
    clock = SimulatedClock(transport)
    topic = transport.topics["/clock"]
    clock.time_advanced(STEP)
    assert topic.sent == []
    topic.connect()
    clock.time_advanced(2 * STEP)
    clock.time_advanced(3 * STEP)
    clock.flush()
    assert topic.sent == [STEP, 2 * STEP, 3 * STEP]
    assert transport.time_ns == 3 * STEP
    assert (clock.watches_steps, clock.watches_time) == (True, False)
    clock.close()
    assert topic.closed


@pytest.mark.parametrize("rate", [0.0, 1000.0])
def test_the_time_is_never_0(transport: Any, rate: float) -> None:
    """ROS takes 0 for no time."""
    clock = SimulatedClock(transport, rate)
    topic = transport.topics["/clock"]
    assert transport.time_ns == FIRST_TIME == 1
    topic.connect()
    for time_ns in (STEP, 0, 1, STEP):  # 0 after a reset
        clock.time_advanced(time_ns)
        clock.flush()
        assert topic.sent[-1] == transport.time_ns == max(time_ns, FIRST_TIME)
        assert stamp(0) == 0
    assert 0 not in topic.sent
    clock.close()


def test_a_reset_that_keeps_the_first_time_does_not_shift_stamps(transport: Any) -> None:
    clock = SimulatedClock(transport)
    clock.keep_time()
    clock.time_advanced(STEP)
    assert (transport.time_ns, stamp(STEP)) == (STEP, STEP)
    clock.close()


def test_the_ros_time_may_continue_when_the_simulated_time_starts_again(transport: Any) -> None:
    clock = SimulatedClock(transport)
    topic = transport.topics["/clock"]
    topic.connect()
    clock.time_advanced(3 * STEP)
    for start in (3 * STEP, 5 * STEP):
        clock.keep_time()
        clock.time_advanced(0)
        assert (topic.sent[-1], transport.time_ns, stamp(0)) == (start, start, start)
        clock.time_advanced(2 * STEP)
        assert (topic.sent[-1], stamp(2 * STEP)) == (start + 2 * STEP, start + 2 * STEP)
    clock.close()
    assert stamp(STEP) == STEP


def test_with_a_limited_rate_a_time_is_published_once(transport: Any) -> None:
    clock = SimulatedClock(transport, rate=0.001)
    topic = transport.topics["/clock"]
    topic.connect()
    wait_until("the first tick", lambda: len(topic.sent) == 2)
    for number in range(1, 4):
        clock.time_advanced(number * STEP)
    assert topic.sent == [FIRST_TIME, FIRST_TIME]
    assert transport.time_ns == 3 * STEP
    clock.flush()
    clock.flush()
    assert topic.sent == [FIRST_TIME, FIRST_TIME, 3 * STEP]
    assert (clock.watches_steps, clock.watches_time) == (False, True)
    threads = [each for each in threading.enumerate() if each.name == "flatland-clock"]
    assert threads
    clock.close()
    for thread in threads:
        thread.join(TIMEOUT)
        assert not thread.is_alive()


def test_an_error_of_the_topic_is_logged_and_reported(
    transport: Any, caplog: pytest.LogCaptureFixture
) -> None:
    clock = SimulatedClock(transport)

    def fail() -> None:
        raise RuntimeError("cause")

    done = clock._run_now(fail)
    assert str(done.exception(0)) == "cause"
    [record] = caplog.records
    assert record.getMessage() == "cannot publish the time"
    assert record.exc_info is not None
    assert clock._run_now(lambda: 5).result(0) == 5
    clock.close()
