"""Measurement of execution times on a shared machine."""

from __future__ import annotations

import time
from collections.abc import Callable


def best_of(action: Callable[[], object], seconds: float = 0.5, min_runs: int = 5) -> float:
    """Returns the minimum execution time of an action [s].

    The minimum is used because disturbances by other programs only increase the time.

    Args:
        action: The measured function.
        seconds: Minimum total duration [s].
        min_runs: Minimum number of runs.
    """
    best = float("inf")
    end = time.perf_counter() + seconds
    runs = 0
    while runs < min_runs or time.perf_counter() < end:
        start = time.perf_counter()
        action()
        best = min(best, time.perf_counter() - start)
        runs += 1
    return best


def best_pair(
    first: Callable[[], object], second: Callable[[], object], seconds: float = 1.0
) -> tuple[float, float]:
    """Returns the minimum execution times of two actions [s].

    The actions alternate, so that both are measured under the same load of the machine.
    """
    best_first = best_second = float("inf")
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        best_first = min(best_first, best_of(first, 0.0, 3))
        best_second = min(best_second, best_of(second, 0.0, 1))
    return best_first, best_second
