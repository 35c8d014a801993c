"""Measurement of execution times on a shared machine."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Mean:
    """The mean execution time of an action in real work.

    Attributes:
        seconds: Mean time [s].
        spread: Standard deviation of the means of several parts of the work, as a share of the
            mean.
    """

    seconds: float
    spread: float

    @classmethod
    def of(cls, times: Sequence[float]) -> Mean:
        """Returns the mean of the times of equal parts of the work [s], at least one."""
        mean = statistics.fmean(times)
        return cls(mean, statistics.pstdev(times) / mean)

    def __truediv__(self, count: float) -> Mean:
        """Returns the mean time of one of `count` equal parts of the action."""
        return Mean(self.seconds / count, self.spread)

    @property
    def rate(self) -> str:
        """How many actions are performed in a second, with the spread."""
        return f"{1 / self.seconds:,.0f} per second ± {100 * self.spread:.0f} %".replace(",", " ")


def mean_of(action: Callable[[], object], seconds: float = 2.0, parts: int = 10) -> Mean:
    """Returns the mean execution time of an action, for throughputs; see `means_of`."""
    return means_of([action], seconds, parts)[0]


def means_of(
    actions: Sequence[Callable[[], object]], seconds: float = 2.0, parts: int = 10
) -> list[Mean]:
    """Returns the mean execution times of actions, for throughputs and their ratios.

    Each call counts, so that the work must contain everything that belongs to it, such as resets
    and garbage collection. The actions take turns, so that all are measured under the same load of
    the machine.

    Args:
        actions: The measured functions.
        seconds: Minimum total duration of each action [s].
        parts: Number of turns, and of the means that determine the spread.
    """
    times: list[list[float]] = [[] for _ in actions]
    totals, calls = [0.0] * len(actions), [0] * len(actions)
    for _ in range(parts):
        for i, action in enumerate(actions):
            start, n = time.perf_counter(), 0
            while (elapsed := time.perf_counter() - start) < seconds / parts:
                action()
                n += 1
            times[i].append(elapsed / n)
            totals[i] += elapsed
            calls[i] += n
    return [
        Mean(total / n, Mean.of(each).spread)
        for total, n, each in zip(totals, calls, times, strict=True)
    ]


def best_of(action: Callable[[], object], seconds: float = 0.5, min_runs: int = 5) -> float:
    """Returns the minimum execution time of an action [s], for the cost of one operation.

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
