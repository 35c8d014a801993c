"""Ticks of wall time in the thread that steps the world."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from waiting import TIMEOUT

from flatland.ros.ticker import Ticker

RATE = 50.0  # Hz


class Loop:
    """Stands for the thread that steps the world: runs what is posted when it is told to."""

    def __init__(self) -> None:
        self.ticks: list[float] = []
        self.goes_on = True
        self._actions: queue.Queue[Callable[[], object]] = queue.Queue()

    def post(self, action: Callable[[], object]) -> Future[Any]:
        self._actions.put(action)
        return Future()

    def tick(self, now: float) -> bool:
        self.ticks.append(now)
        return self.goes_on

    def run_next(self, timeout: float = TIMEOUT) -> None:
        self._actions.get(timeout=timeout)()

    def wait_for_post(self) -> None:
        self._actions.put(self._actions.get(timeout=TIMEOUT))

    def idle(self, seconds: float) -> bool:
        """Whether nothing is posted for some time."""
        try:
            self._actions.put(self._actions.get(timeout=seconds))
        except queue.Empty:
            return True
        return False


@pytest.fixture
def loop() -> Loop:
    return Loop()


@pytest.fixture
def ticker(loop: Loop) -> Iterator[Ticker]:
    ticker = Ticker("test-ticker", RATE, loop.post, loop.tick)
    yield ticker
    ticker.close()


def test_starts_asleep(loop: Loop, ticker: Ticker) -> None:
    assert loop.idle(3 / RATE)


def test_ticks_are_a_period_apart_at_least(loop: Loop, ticker: Ticker) -> None:
    ticker.wake()
    for _ in range(10):
        loop.run_next()
    gaps = [b - a for a, b in zip(loop.ticks, loop.ticks[1:], strict=False)]
    assert min(gaps) >= 1 / RATE


def test_none_is_queued_while_another_waits(loop: Loop, ticker: Ticker) -> None:
    ticker.wake()
    loop.run_next()
    time.sleep(20 / RATE)  # The loop is busy for many periods: one tick waits, the rest is lost.
    loop.run_next()
    loop.run_next()
    assert loop.ticks[2] - loop.ticks[1] > 5 / RATE


def test_rests_and_wakes(loop: Loop, ticker: Ticker) -> None:
    loop.goes_on = False
    ticker.wake()
    loop.run_next()
    assert loop.idle(3 / RATE)
    ticker.wake()
    loop.run_next()
    assert len(loop.ticks) == 2


def test_what_comes_during_the_last_tick_wakes_it_again(loop: Loop) -> None:
    """Such as a subscriber, right after the tick found that there is none."""

    ticks: list[float] = []

    def tick(now: float) -> bool:
        ticks.append(now)
        ticker.wake()
        return False

    ticker = Ticker("woken", RATE, loop.post, tick)
    ticker.wake()
    for _ in range(3):
        loop.run_next()
    ticker.close()
    assert len(ticks) == 3


@pytest.mark.parametrize("waits_for", ["wake", "period", "loop"])
def test_close_ends_the_thread_whatever_it_waits_for(loop: Loop, waits_for: str) -> None:
    ticker = Ticker(f"closing-{waits_for}", 1e-4, loop.post, loop.tick)
    (thread,) = [t for t in threading.enumerate() if t.name == f"closing-{waits_for}"]
    if waits_for != "wake":
        ticker.wake()
        loop.wait_for_post()
    if waits_for == "period":
        loop.run_next()  # The next tick is due in hours.
    assert thread.is_alive()
    ticker.close()
    thread.join(TIMEOUT)
    assert not thread.is_alive()
    assert len(loop.ticks) == (waits_for == "period")


def test_tick_that_was_posted_before_the_end_does_nothing(loop: Loop, ticker: Ticker) -> None:
    ticker.wake()
    loop.wait_for_post()
    ticker.close()
    loop.run_next()
    assert loop.ticks == []


def test_tick_that_raises_is_not_the_last(loop: Loop) -> None:
    def fail(_now: float) -> bool:
        raise ValueError("as asked for")

    ticker = Ticker("failing", RATE, loop.post, fail)
    ticker.wake()
    for _ in range(2):
        with pytest.raises(ValueError, match="as asked for"):
            loop.run_next()
    ticker.close()
