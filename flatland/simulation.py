"""The loop: steps a world in real time or as fast as it can, until it is told to stop."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Final

from flatland.timekeeper import NANOSECONDS
from flatland.world import World

_PAUSED_CYCLE: Final = 0.01  # s between two looks at a paused world that has no rate
_LONGEST_WAIT: Final = 3600.0  # s; more than some can be waited for is an error of Python's


@dataclass(frozen=True, slots=True)
class CycleStatistics:
    """How the loop did since its last report.

    The use of a cycle is the time worked in it, in percent of the cycle's length; when the loop
    runs as fast as possible there is no such length, and the step size takes its place.

    Attributes:
        cycles: How many cycles there were.
        use_min: Least use of a cycle [%].
        use_max: Greatest use of a cycle [%].
        use_mean: Mean use of a cycle [%].
        asked: Real-time factor that the loop was asked for, inf for as fast as possible.
        got: Simulated time over wall time.
    """

    cycles: int
    use_min: float
    use_max: float
    use_mean: float
    asked: float
    got: float

    def __str__(self) -> str:
        """Writes the statistics in one line."""
        return (
            f"cycle use min {self.use_min:.1f} %, max {self.use_max:.1f} %, "
            f"mean {self.use_mean:.1f} %; real-time factor asked {self.asked:.2f}, "
            f"got {self.got:.2f}"
        )


@dataclass(frozen=True, slots=True)
class RunResult:
    """What one run of the loop did.

    Attributes:
        steps: Steps of the world.
        wall_time: How long they took [s].
    """

    steps: int
    wall_time: float

    @property
    def steps_per_second(self) -> float:
        """Steps in a second of wall time."""
        return self.steps / self.wall_time if self.wall_time > 0 else 0.0


class Simulation:
    """Steps a world at a rate; everything in it happens in the thread that calls `run`.

    Attributes:
        world: The world.
    """

    def __init__(
        self,
        world: World,
        update_rate: float = 200.0,
        *,
        report: Callable[[CycleStatistics], None] | None = None,
        report_period: float = 1.0,
    ) -> None:
        """Prepares to step a world.

        Args:
            world: The world.
            update_rate: Steps in a second of wall time [Hz]; 0 or inf for as many as possible.
            report: Called with statistics while the world runs.
            report_period: Wall time between two reports [s].

        Raises:
            ValueError: The rate is negative or not a number.
        """
        self.world = world
        self._period = _period_of(update_rate)
        self._report = report
        self._report_period = report_period
        self._wake = threading.Event()
        self._stopped = False

    @property
    def stopped(self) -> bool:
        """Whether `stop` was called."""
        return self._stopped

    def set_rate(self, update_rate: float) -> None:
        """Changes the rate from the next step on; between two steps, or while nothing runs.

        Args:
            update_rate: Steps in a second of wall time [Hz]; 0 or inf for as many as possible.

        Raises:
            ValueError: The rate is negative or not a number.
        """
        self._period = _period_of(update_rate)

    def stop(self) -> None:
        """Makes `run` return after the step that it is in; safe from any thread."""
        self._stopped = True
        self._wake.set()

    def post(self, action: Callable[[], object]) -> Future[Any]:
        """Queues an action that runs between two steps, soon, also while the world is paused.

        Safe from any thread; see `World.post`.
        """
        future = self.world.post(action)
        self._wake.set()
        return future

    def run(self, duration: float = math.inf) -> RunResult:
        """Steps the world until `stop` is called or some simulated time has passed.

        Args:
            duration: Simulated time to run for [s].
        """
        world, period = self.world, self._period
        timekeeper = world.timekeeper
        start_ns = timekeeper.sim_time_ns
        end_ns = math.inf if math.isinf(duration) else start_ns + round(duration * NANOSECONDS)
        window = _Window(period or timekeeper.step_size, self._asked(), timekeeper.sim_time_ns)
        start = due = time.perf_counter()
        while not self._stopped and timekeeper.sim_time_ns < end_ns:
            begin = time.perf_counter()
            if self._period != period:
                # The rate was changed: what was due at the old one no longer matters.
                period, due = self._period, begin
                window = _Window(
                    period or timekeeper.step_size, self._asked(), timekeeper.sim_time_ns
                )
            world.step()
            end = time.perf_counter()
            window.add(end - begin)
            if end - window.start >= self._report_period:
                self._finish(window, end)
                window = _Window(window.length, window.asked, timekeeper.sim_time_ns)
            if period:
                due += period
                # Lost time is lost: at most one cycle is made up for.
                if end - due > period:
                    due = end
                self._wait_until(due, period)
            elif world.paused:
                self._wait_until(end + _PAUSED_CYCLE, period)
        steps = (timekeeper.sim_time_ns - start_ns) // timekeeper.step_size_ns
        return RunResult(steps, time.perf_counter() - start)

    def _wait_until(self, due: float, period: float) -> None:
        """Waits for a time of the wall clock and carries out what is asked for meanwhile.

        Returns at once when that changes the period.
        """
        while not self._stopped and self._period == period:
            left = due - time.perf_counter()
            if left <= 0:
                return
            if self._wake.wait(min(left, _LONGEST_WAIT)):
                self._wake.clear()
                self.world.process_requests()

    def _asked(self) -> float:
        if not self._period:
            return math.inf
        return self.world.timekeeper.step_size / self._period

    def _finish(self, window: _Window, now: float) -> None:
        """Reports what a window saw, unless the world stood still in it."""
        advanced_ns = self.world.timekeeper.sim_time_ns - window.start_ns
        if self._report is not None and advanced_ns > 0:
            self._report(window.statistics(now, advanced_ns))


def _period_of(update_rate: float) -> float:
    """Returns the wall time between two steps [s], 0 for as little as possible.

    Raises:
        ValueError: The rate is negative or not a number.
    """
    if math.isnan(update_rate) or update_rate < 0:
        raise ValueError(f"update_rate must not be negative, got {update_rate}")
    return 0.0 if update_rate == 0 else 1.0 / update_rate


class _Window:
    """Adds up the cycles between two reports."""

    def __init__(self, length: float, asked: float, start_ns: int) -> None:
        self.length = length
        self.asked = asked
        self.start_ns = start_ns
        self.start = time.perf_counter()
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

    def statistics(self, now: float, advanced_ns: int) -> CycleStatistics:
        percent = 100.0 / self.length
        return CycleStatistics(
            cycles=self._count,
            use_min=self._min * percent,
            use_max=self._max * percent,
            use_mean=self._sum / self._count * percent,
            asked=self.asked,
            got=advanced_ns / NANOSECONDS / (now - self.start),
        )
