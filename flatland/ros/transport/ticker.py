"""Periodic actions in wall time, run in the thread that steps the world."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final

_MIN_PERIOD: Final = 0.001  # s
_CLOSE_POLL_PERIOD: Final = 0.2  # s between two checks whether the ticker is closed


class Ticker:
    """Calls a function periodically while it is awake, even if the world is paused.

    Two ticks are at least one period apart, and at most one tick is queued. A sleeping ticker uses
    no CPU time.
    """

    def __init__(
        self,
        name: str,
        rate: float,
        post: Callable[[Callable[[], object]], Future[Any]],
        tick: Callable[[float], bool],
    ) -> None:
        """Creates a sleeping ticker.

        Args:
            name: Name of the thread.
            rate: Ticks per second of wall time [Hz].
            post: Runs an action between two steps.
            tick: Called between two steps with the time at which the tick was due
                (`time.monotonic`); returns whether to stay awake. An exception does not end the
                ticker.
        """
        self._period = max(_MIN_PERIOD, 1.0 / rate)
        self._post = post
        self._tick = tick
        self._awake = threading.Event()
        self._closed = threading.Event()
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def wake(self) -> None:
        """Starts ticking, with the first tick as soon as possible; thread-safe."""
        self._awake.set()

    def close(self) -> None:
        """Ends the ticker and its thread."""
        self._closed.set()
        self._awake.set()

    def _run(self) -> None:
        due = 0.0
        while True:
            self._awake.wait()
            if self._closed.wait(max(0.0, due - time.monotonic())):
                return
            now = time.monotonic()
            due = now + self._period
            done = threading.Event()
            self._post(lambda now=now, done=done: self._tick_once(now, done))  # type: ignore[misc]
            while not done.wait(_CLOSE_POLL_PERIOD):
                if self._closed.is_set():
                    return

    def _tick_once(self, now: float, done: threading.Event) -> None:
        # Sleep before the call, not after it: `wake` may be called while the tick decides that
        # there is nothing left to do.
        self._awake.clear()
        stay_awake = True
        try:
            stay_awake = not self._closed.is_set() and self._tick(now)
        finally:
            if stay_awake or self._closed.is_set():
                self._awake.set()
            done.set()
