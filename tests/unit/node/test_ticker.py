"""Periodic actions in the thread that steps the world."""

from __future__ import annotations

import itertools
import math
import queue
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from waiting import TIMEOUT

from flatland.node.ticker import Ticker, TickerThread

RATE = 50.0  # Hz
ROUNDING = 1e-9  # s; of differences of times


class Loop:
    """Replaces the thread that steps the world; runs posted actions on demand."""

    def __init__(self) -> None:
        self.ticks: list[float] = []
        self.stay_awake = True
        self._actions: queue.Queue[Callable[[], object]] = queue.Queue()

    def post(self, action: Callable[[], object]) -> Future[Any]:
        self._actions.put(action)
        return Future()

    def tick(self, now: float) -> bool:
        self.ticks.append(now)
        return self.stay_awake

    def run_next(self, timeout: float = TIMEOUT) -> None:
        self._actions.get(timeout=timeout)()

    @property
    def queued(self) -> int:
        return self._actions.qsize()

    def wait_for_post(self) -> None:
        self._actions.put(self._actions.get(timeout=TIMEOUT))

    def idle(self, seconds: float) -> bool:
        """Returns whether no action is posted within some time."""
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


def test_new_ticker_is_asleep(loop: Loop, ticker: Ticker) -> None:
    assert loop.idle(3 / RATE)


def test_ticks_are_at_least_a_period_apart(loop: Loop, ticker: Ticker) -> None:
    ticker.wake()
    for _ in range(10):
        loop.run_next()
    gaps = [b - a for a, b in zip(loop.ticks, loop.ticks[1:], strict=False)]
    assert min(gaps) >= 1 / RATE - ROUNDING


def test_an_infinite_rate_is_limited(loop: Loop) -> None:
    ticker = Ticker("fast", math.inf, loop.post, loop.tick)
    assert ticker.period == 0.001
    ticker.close()


def test_at_most_one_tick_is_queued(loop: Loop, ticker: Ticker) -> None:
    ticker.wake()
    loop.run_next()
    loop.wait_for_post()
    time.sleep(5 / RATE)  # The loop is busy for some periods.
    assert loop.queued == 1
    loop.run_next()
    assert len(loop.ticks) == 2


def test_ticker_sleeps_and_wakes(loop: Loop, ticker: Ticker) -> None:
    loop.stay_awake = False
    ticker.wake()
    loop.run_next()
    assert loop.idle(3 / RATE)
    ticker.wake()
    loop.run_next()
    assert len(loop.ticks) == 2


def test_wake_during_the_last_tick_is_not_lost(loop: Loop) -> None:
    """For example, a subscriber may connect right after the tick has found none."""

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
    if waits_for == "loop":
        loop.run_next()  # A tick that was posted before is skipped.
    assert len(loop.ticks) == (waits_for == "period")


# -- tickers of one thread ---------------------------------------------------------------------


def test_tickers_of_one_thread_with_the_same_rate_tick_in_one_action(loop: Loop) -> None:
    thread = TickerThread("shared", loop.post)
    counts = [0, 0]
    log: list[tuple[int, ...]] = []

    def count(number: int) -> Callable[[float], bool]:
        def tick(_now: float) -> bool:
            counts[number] += 1
            return True

        return tick

    tickers = [Ticker("", RATE, loop.post, count(number), thread) for number in range(2)]
    tickers[0].wake()
    loop.run_next()
    time.sleep(0.5 / RATE)
    tickers[1].wake()  # Its first tick is due at once, half a period from those of the other.
    for _ in range(8):
        loop.run_next()
        log.append(tuple(counts))
    for ticker in tickers:
        ticker.close()
    # From the third action on, at the latest, both tick in each.
    assert [b[0] - a[0] for a, b in itertools.pairwise(log[2:])] == [1] * 5
    assert [b[1] - a[1] for a, b in itertools.pairwise(log[2:])] == [1] * 5


def test_tickers_of_one_thread_keep_their_rates(loop: Loop) -> None:
    thread = TickerThread("two rates", loop.post)
    times: tuple[list[float], list[float]] = ([], [])

    def record(number: int) -> Callable[[float], bool]:
        return lambda now: times[number].append(now) is None

    rates = (RATE, RATE / 10)
    tickers = [
        Ticker("", rate, loop.post, record(number), thread) for number, rate in enumerate(rates)
    ]
    for ticker in tickers:
        ticker.wake()
    while len(times[1]) < 3:
        loop.run_next()
    for ticker in tickers:
        ticker.close()
    for rate, ticks in zip(rates, times, strict=True):
        assert min(b - a for a, b in itertools.pairwise(ticks)) >= 1 / rate - ROUNDING
    assert len(times[0]) >= len(times[1])


def test_thread_ends_with_its_last_ticker(loop: Loop) -> None:
    shared = TickerThread("ending", loop.post)
    first, second = (Ticker("", RATE, loop.post, loop.tick, shared) for _ in range(2))
    (thread,) = [t for t in threading.enumerate() if t.name == "ending"]
    first.close()
    second.wake()
    loop.run_next()
    assert len(loop.ticks) == 1
    second.close()
    second.close()
    thread.join(TIMEOUT)
    assert not thread.is_alive()


def test_exceptions_in_ticks_affect_neither_their_ticker_nor_others(loop: Loop) -> None:
    thread = TickerThread("failing", loop.post)
    errors: list[ValueError] = []

    def fail(_now: float) -> bool:
        raise ValueError("expected")

    tickers = [Ticker("", RATE, loop.post, tick, thread) for tick in (fail, loop.tick)]
    for ticker in tickers:
        ticker.wake()
    while len(loop.ticks) < 3:
        try:
            loop.run_next()
        except ValueError as error:
            errors.append(error)
    assert len(errors) > 1
    for ticker in tickers:
        ticker.close()
