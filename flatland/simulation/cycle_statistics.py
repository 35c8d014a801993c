"""Statistics of the cycles of a loop."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flatland.timekeeper import NANOSECONDS


@dataclass(frozen=True, slots=True)
class CycleStatistics:
    """How a loop performed since its last report.

    The use of a cycle is the time worked in it, in percent of the cycle's length. A loop that runs
    as fast as possible has no such length, and the step size takes its place.

    Attributes:
        cycles: Number of cycles.
        use_min: Least use of a cycle [%].
        use_max: Greatest use of a cycle [%].
        use_mean: Mean use of a cycle [%].
        asked: Requested real-time factor, inf for as fast as possible.
        got: Simulated time over wall time.
    """

    cycles: int
    use_min: float
    use_max: float
    use_mean: float
    asked: float
    got: float

    def __str__(self) -> str:
        """Returns the statistics in one line."""
        return (
            f"cycle use min {self.use_min:.1f} %, max {self.use_max:.1f} %, "
            f"mean {self.use_mean:.1f} %; real-time factor asked {self.asked:.2f}, "
            f"got {self.got:.2f}"
        )


class CycleWindow:
    """Accumulates the cycles between two reports.

    Attributes:
        length: Length of a cycle [s].
        asked: Requested real-time factor.
        start: Wall time at the start [s].
        start_ns: Simulated time at the start [ns].
    """

    def __init__(self, length: float, asked: float, start: float, start_ns: int) -> None:
        """Starts without cycles; the arguments are the attributes."""
        self.length = length
        self.asked = asked
        self.start = start
        self.start_ns = start_ns
        self._count = 0
        self._sum = 0.0
        self._min = math.inf
        self._max = 0.0

    def add(self, worked: float) -> None:
        """Counts a cycle in which the loop worked for some time [s]."""
        self._count += 1
        self._sum += worked
        if worked < self._min:
            self._min = worked
        if worked > self._max:
            self._max = worked

    def statistics(self, now: float, now_ns: int) -> CycleStatistics:
        """Returns the statistics of at least one cycle.

        Args:
            now: The present wall time [s].
            now_ns: The present simulated time [ns].
        """
        percent = 100.0 / self.length
        return CycleStatistics(
            cycles=self._count,
            use_min=self._min * percent,
            use_max=self._max * percent,
            use_mean=self._sum / self._count * percent,
            asked=self.asked,
            got=(now_ns - self.start_ns) / NANOSECONDS / (now - self.start),
        )
