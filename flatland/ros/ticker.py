"""Does something at a rate of wall time, in the thread that steps the world."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final

_SHORTEST_PERIOD: Final = 0.001  # s
_PATIENCE: Final = 0.2  # s between two looks whether to end


class Ticker:
    """Ticks while it is awake, also while the world is paused; asleep it costs nothing.

    Two ticks are never closer than a period, and none is queued while another waits.
    """

    def __init__(
        self,
        name: str,
        rate: float,
        post: Callable[[Callable[[], object]], Future[Any]],
        tick: Callable[[float], bool],
    ) -> None:
        """Starts asleep.

        Args:
            name: Of the thread.
            rate: Ticks in a second of wall time [Hz].
            post: Runs an action between two steps.
            tick: Called between two steps, with the time of `time.monotonic` at which it was
                due; tells whether to tick on. What it raises must not matter.
        """
        self._period = max(_SHORTEST_PERIOD, 1.0 / rate)
        self._post = post
        self._tick = tick
        self._awake = threading.Event()
        self._closed = threading.Event()
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def wake(self) -> None:
        """Ticks from now on, the first time at once; safe from any thread."""
        self._awake.set()

    def close(self) -> None:
        """Ends for good."""
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
            while not done.wait(_PATIENCE):
                if self._closed.is_set():
                    return

    def _tick_once(self, now: float, done: threading.Event) -> None:
        # Asleep already when the tick looks whether there is still something to do: what comes
        # after that look wakes it again.
        self._awake.clear()
        goes_on = True
        try:
            goes_on = not self._closed.is_set() and self._tick(now)
        finally:
            if goes_on or self._closed.is_set():
                self._awake.set()
            done.set()
