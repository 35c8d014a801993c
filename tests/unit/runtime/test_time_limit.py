"""Limits of wall time: interruption of code, and its effects."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from types import FrameType

import pytest
from waiting import wait_until

from flatland.runtime.time_limit import TimeLimitExceeded, call_with_limit

LIMIT = 0.05


def loop() -> None:
    while True:
        pass


def stubborn_loop() -> None:
    interruptions = 0
    while interruptions < 3:
        try:
            loop()
        except BaseException:
            interruptions += 1
    loop()


def in_thread(run: Callable[[], object]) -> BaseException | None:
    """Runs a function in a new thread and returns its exception."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(run).exception()


def limited(run: Callable[[], object]) -> None:
    call_with_limit(LIMIT, run)


@pytest.fixture
def alarms() -> Iterator[list[int]]:
    """The numbers of the alarms that this program has received; without that of pytest-timeout."""
    received: list[int] = []
    handler = signal.signal(signal.SIGALRM, lambda number, _frame: received.append(number))
    timer = signal.setitimer(signal.ITIMER_REAL, 0)
    yield received
    signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, *timer)


@pytest.mark.parametrize(
    "block",
    [loop, stubborn_loop, lambda: time.sleep(1e6), lambda: threading.Event().wait()],
    ids=["loop", "stubborn loop", "sleep", "lock"],
)
def test_code_that_blocks_the_main_thread_is_interrupted(
    alarms: list[int], block: Callable[[], object]
) -> None:
    handler = signal.getsignal(signal.SIGALRM)
    with pytest.raises(TimeLimitExceeded):
        limited(block)
    assert signal.getsignal(signal.SIGALRM) is handler
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert not alarms


RUNS = pytest.mark.parametrize("run", [lambda: None, loop], ids=["in time", "too late"])


@RUNS
@pytest.mark.parametrize("timer", [(0.0, 0.0), (1000.0, 7.0)], ids=["none", "later"])
def test_the_alarm_of_the_program_is_restored(
    alarms: list[int], timer: tuple[float, float], run: Callable[[], object]
) -> None:
    handler = signal.getsignal(signal.SIGALRM)
    signal.setitimer(signal.ITIMER_REAL, *timer)
    with pytest.raises(TimeLimitExceeded) if run is loop else nullcontext():
        limited(run)
    left, period = signal.getitimer(signal.ITIMER_REAL)
    assert signal.getsignal(signal.SIGALRM) is handler
    # The time of the call has passed for the alarm as well.
    assert left == 0.0 if timer[0] == 0.0 else 0.0 < left < 1000.0 - (LIMIT if run is loop else 0.0)
    assert period == timer[1]
    assert not alarms


def test_an_alarm_of_the_program_that_is_due_during_the_call_arrives_afterwards(
    alarms: list[int],
) -> None:
    signal.setitimer(signal.ITIMER_REAL, LIMIT / 5)
    with pytest.raises(TimeLimitExceeded):
        limited(loop)
    wait_until("the alarm", lambda: alarms == [signal.SIGALRM])


def test_python_code_in_another_thread_is_interrupted() -> None:
    assert isinstance(in_thread(lambda: limited(loop)), TimeLimitExceeded)


@pytest.mark.parametrize("in_main_thread", [False, True])
def test_code_that_returns_in_time_is_not_interrupted(in_main_thread: bool) -> None:
    def run() -> None:
        for _ in range(20):
            assert call_with_limit(10, lambda: 3) == 3
        with pytest.raises(KeyError):
            call_with_limit(10, lambda: {}["missing"])

    if in_main_thread:
        run()
    else:
        assert in_thread(run) is None


def test_without_a_limit_nothing_is_interrupted(alarms: list[int]) -> None:
    assert call_with_limit(None, lambda: signal.getitimer(signal.ITIMER_REAL)) == (0.0, 0.0)
    assert not alarms


@RUNS
def test_the_trace_function_of_a_thread_is_restored(run: Callable[[], object]) -> None:
    def previous(_frame: FrameType, _event: str, _argument: object) -> None:
        pass

    def check() -> None:
        sys.settrace(previous)
        try:
            with pytest.raises(TimeLimitExceeded) if run is loop else nullcontext():
                limited(run)
            assert sys.gettrace() is previous
        finally:
            sys.settrace(None)

    assert in_thread(check) is None
