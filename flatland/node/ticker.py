"""Periodic actions in wall time, run in the thread that steps the world."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final

_MIN_PERIOD: Final = 0.001  # s


class TickerThread:
    """The thread of one or several tickers.

    Tickers with the same period tick together, in one action of the thread that steps the world:
    each switch between two threads costs more than most ticks.
    """

    def __init__(self, name: str, post: Callable[[Callable[[], object]], Future[Any]]) -> None:
        """Creates a thread that starts with its first ticker and ends with its last one.

        Args:
            name: Name of the thread.
            post: Runs an action between two steps.
        """
        self._post = post
        self._tickers: list[Ticker] = []
        self._changed = threading.Condition()  # guards all members of the tickers as well
        self._is_queued = False  # whether an action is queued or running
        self._wakes_at = math.inf  # s, `time.monotonic`; time until which the thread waits
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def add(self, ticker: Ticker) -> None:
        """Adds a ticker; called by its constructor."""
        with self._changed:
            self._tickers.append(ticker)
            if self._thread.ident is None:
                self._thread.start()

    def wake(self, ticker: Ticker) -> None:
        """Starts ticking, with the first tick as soon as possible."""
        with self._changed:
            ticker.awake = True
            self._notify()

    def close(self, ticker: Ticker) -> None:
        """Removes a ticker."""
        with self._changed:
            ticker.closed = True
            if ticker in self._tickers:
                self._tickers.remove(ticker)
            self._closed = not self._tickers
            self._changed.notify()

    def _run(self) -> None:
        while True:
            with self._changed:
                tickers, now = self._wait_for_due()
                if self._closed:
                    return
                self._is_queued = True
            self._post(lambda tickers=tickers, now=now: self._tick(tickers, now))  # type: ignore[misc]

    def _wait_for_due(self) -> tuple[list[Ticker], float]:
        """Waits for tickers that are due, and for the end of the previous action.

        Returns:
            The tickers, with the times of their next ticks set, and the time of this tick; no
            tickers if the thread is to end.
        """
        while not self._closed:
            awake = [ticker for ticker in self._tickers if ticker.awake]
            now = time.monotonic()
            due = [ticker for ticker in awake if ticker.due <= now]
            if due and not self._is_queued:
                periods = {ticker.period for ticker in due}
                for ticker in awake:
                    # Those that are not due yet are delayed, so that they tick together from then
                    # on; times of ticks that do so already are equal.
                    if ticker.period in periods:
                        ticker.due = now + ticker.period
                return due, now
            # With tickers that are due, it waits for the end of the action that is queued.
            self._wakes_at = math.inf if due else self._next_due()
            limit = None if math.isinf(self._wakes_at) else self._wakes_at - now
            self._changed.wait(limit)
        return [], math.nan

    def _next_due(self) -> float:
        return min((ticker.due for ticker in self._tickers if ticker.awake), default=math.inf)

    def _notify(self) -> None:
        """Wakes the thread if it would otherwise wait for too long."""
        if self._next_due() < self._wakes_at:
            self._changed.notify()

    def _tick(self, tickers: list[Ticker], now: float) -> None:
        """Calls the functions of tickers; in the thread that steps the world."""
        try:
            failure: BaseException | None = None
            for ticker in tickers:
                # Sleep before the call, not after it: `wake` may be called while the tick decides
                # that there is nothing left to do.
                with self._changed:
                    ticker.awake = False
                stay_awake = True
                try:
                    stay_awake = not ticker.closed and ticker.tick(now)
                except BaseException as error:
                    failure = error
                if stay_awake:
                    with self._changed:
                        ticker.awake = True
            if failure is not None:
                raise failure
        finally:
            with self._changed:
                self._is_queued = False
                self._notify()


class Ticker:
    """Calls a function periodically while it is awake, even if the world is paused.

    Two ticks are at least one period apart, and at most one tick is queued. A sleeping ticker uses
    no CPU time.

    Attributes:
        period: Time between two ticks [s].
        tick: The function.
        due: Time of the next tick (`time.monotonic`) [s]; the attributes from here on belong to the
            thread.
        awake: Whether it ticks.
        closed: Whether it was closed.
    """

    def __init__(
        self,
        name: str,
        rate: float,
        post: Callable[[Callable[[], object]], Future[Any]],
        tick: Callable[[float], bool],
        thread: TickerThread | None = None,
    ) -> None:
        """Creates a sleeping ticker.

        Args:
            name: Name of the thread.
            rate: Ticks per second of wall time [Hz].
            post: Runs an action between two steps.
            tick: Called between two steps with the time at which the tick was due
                (`time.monotonic`); returns whether to stay awake. An exception does not end the
                ticker.
            thread: The thread to share with other tickers; None for a thread of its own.
        """
        self.period = max(_MIN_PERIOD, 1.0 / rate)
        self.tick = tick
        self.due = 0.0
        self.awake = False
        self.closed = False
        self._thread = TickerThread(name, post) if thread is None else thread
        self._thread.add(self)

    def wake(self) -> None:
        """Starts ticking, with the first tick as soon as possible; thread-safe."""
        self._thread.wake(self)

    def close(self) -> None:
        """Ends the ticker, and its thread if it is the last one; further calls have no effect."""
        self._thread.close(self)
