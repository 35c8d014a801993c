"""How times are taken on a noisy machine."""

from __future__ import annotations

import time
from collections.abc import Callable


def best_of(action: Callable[[], object], seconds: float = 0.5, least: int = 5) -> float:
    """Returns the least time [s] that an action took, tried for so many seconds.

    What disturbs a measurement on a shared machine only ever makes it longer.
    """
    best = float("inf")
    end = time.perf_counter() + seconds
    tries = 0
    while tries < least or time.perf_counter() < end:
        start = time.perf_counter()
        action()
        best = min(best, time.perf_counter() - start)
        tries += 1
    return best


def best_pair(
    first: Callable[[], object], second: Callable[[], object], seconds: float = 1.0
) -> tuple[float, float]:
    """Returns the least times [s] of two actions that take turns, so that both see one machine."""
    best_first = best_second = float("inf")
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        best_first = min(best_first, best_of(first, 0.0, 3))
        best_second = min(best_second, best_of(second, 0.0, 1))
    return best_first, best_second
