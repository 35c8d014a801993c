"""Statistics of the cycles of a loop."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flatland.timekeeper import NANOSECONDS


@dataclass(frozen=True, slots=True)
class CycleStatistics:
    """The performance of a loop since its last report.

    The use of a cycle is the wall time spent working in it, in percent of the length of the cycle.
    A loop that runs as fast as possible has no cycle length; the step size takes its place.

    Attributes:
        cycles: Number of cycles.
        use_min: Least use of a cycle [%].
        use_max: Greatest use of a cycle [%].
        use_mean: Mean use of a cycle [%].
        target: Target real-time factor, inf for as fast as possible.
        actual: Measured real-time factor: simulated time over wall time.
    """

    cycles: int
    use_min: float
    use_max: float
    use_mean: float
    target: float
    actual: float

    def __str__(self) -> str:
        """Returns the statistics in one line."""
        return (
            f"cycle use min {self.use_min:.1f} %, max {self.use_max:.1f} %, "
            f"mean {self.use_mean:.1f} %; real-time factor: target {self.target:.2f}, "
            f"actual {self.actual:.2f}"
        )


class CycleWindow:
    """Accumulates the cycles between two reports.

    Attributes:
        length: Length of a cycle [s].
        target: Target real-time factor, inf for as fast as possible.
        start: Wall time at the start [s].
        start_ns: Simulated time at the start [ns].
    """

    def __init__(self, length: float, target: float, start: float, start_ns: int) -> None:
        """Creates a window without cycles; the arguments are the attributes."""
        self.length = length
        self.target = target
        self.start = start
        self.start_ns = start_ns
        self._count = 0
        self._sum = 0.0
        self._min = math.inf
        self._max = 0.0

    def add(
        self, worked: float, count: int = 1, extremes: tuple[float, float] | None = None
    ) -> None:
        """Adds a cycle, or several.

        Args:
            worked: Wall time spent working in all cycles [s].
            count: Number of cycles.
            extremes: Wall time spent working in the shortest and in the longest one [s]; None if
                all are of the same length.
        """
        if not count:
            return
        self._count += count
        self._sum += worked
        least, most = extremes or (worked / count, worked / count)
        if least < self._min:
            self._min = least
        if most > self._max:
            self._max = most

    def statistics(self, now: float, now_ns: int) -> CycleStatistics:
        """Returns the statistics of the cycles added, of which there must be at least one.

        Args:
            now: Current wall time [s].
            now_ns: Current simulated time [ns].
        """
        percent = 100.0 / self.length
        return CycleStatistics(
            cycles=self._count,
            use_min=self._min * percent,
            use_max=self._max * percent,
            use_mean=self._sum / self._count * percent,
            target=self.target,
            actual=(now_ns - self.start_ns) / NANOSECONDS / (now - self.start),
        )
