"""The loop that steps a world in real time or as fast as possible until it is stopped."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Final

from flatland.simulation.cycle_statistics import CycleStatistics, CycleWindow
from flatland.simulation.rate_monitor import RateMonitor
from flatland.timekeeper import NANOSECONDS
from flatland.world import World

MAX_LAG: Final = 0.1
"""Lost wall time that a loop makes up for unless told otherwise [s]."""

_PAUSED_CYCLE: Final = 0.01  # s between two cycles of a paused world that has no rate
_LONGEST_WAIT: Final = 3600.0  # s; Python refuses to wait for more than some centuries


@dataclass(frozen=True, slots=True)
class RunResult:
    """What one run of the loop did.

    Attributes:
        steps: Number of steps of the world.
        wall_time: Their duration [s].
    """

    steps: int
    wall_time: float

    @property
    def steps_per_second(self) -> float:
        """Steps in a second of wall time."""
        return self.steps / self.wall_time if self.wall_time > 0 else 0.0


class Simulation:
    """Steps a world at a rate; everything in it happens in the thread that calls `run`.

    A cycle that starts late is followed by the next ones without a wait until the lost time is
    made up for. Of a greater lag than `max_lag` only that much is made up for and the rest is
    dropped, so that no burst of steps is longer, whatever stopped the loop: a slow plugin, a long
    load, a debugger. A lag of up to one cycle is always made up for. Nothing is made up for across
    a pause or a change of the rate. When the loop keeps losing time, a warning names the most
    expensive plugins.

    Attributes:
        world: The world.
    """

    def __init__(
        self,
        world: World,
        update_rate: float = 200.0,
        *,
        max_lag: float = MAX_LAG,
        report: Callable[[CycleStatistics], None] | None = None,
        report_period: float = 1.0,
        clock: Callable[[], float] = time.perf_counter,
        wait: Callable[[threading.Event, float], bool] = threading.Event.wait,
    ) -> None:
        """Prepares to step a world.

        Args:
            world: The world.
            update_rate: Steps in a second of wall time [Hz]; 0 or inf for as many as possible.
            max_lag: Lost wall time that is made up for at most [s]; 0 for one cycle at most.
            report: Called with statistics while the world runs.
            report_period: Wall time between two reports [s].
            clock: Returns the wall time [s].
            wait: Waits for an event for at most some wall time [s]; returns whether it is set.

        Raises:
            ValueError: The rate or the lag is negative or not a number, or the lag is infinite.
        """
        if not 0 <= max_lag < math.inf:
            raise ValueError(f"max_lag must be finite and not negative [s], got {max_lag}")
        self.world = world
        self._period = _period_of(update_rate)
        self._max_lag = max_lag
        self._report = report
        self._report_period = report_period
        self._clock = clock
        self._wait = wait
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
        """Makes `run` return after the current step; safe from any thread."""
        self._stopped = True
        self._wake.set()

    def post(self, action: Callable[[], object]) -> Future[Any]:
        """Queues an action that runs between two steps; safe from any thread, see `World.post`.

        It runs soon, also while the loop waits or the world is paused.
        """
        return self.world.post(action)

    def run(self, duration: float = math.inf) -> RunResult:
        """Steps the world until `stop` is called or some simulated time has passed.

        Meanwhile all requests of other threads are carried out in the calling thread.

        Args:
            duration: Simulated time to run for [s].

        Raises:
            WorldError: The world is closed, or another simulation runs it.
        """
        timekeeper = self.world.timekeeper
        start, start_ns = self._clock(), timekeeper.sim_time_ns
        end_ns = math.inf if math.isinf(duration) else start_ns + round(duration * NANOSECONDS)
        monitor = RateMonitor(self.world, self._clock)
        try:
            with self.world.requests.serving(self._wake.set):
                self._loop(start, end_ns, monitor)
        finally:
            monitor.reset()
        steps = (timekeeper.sim_time_ns - start_ns) // timekeeper.step_size_ns
        return RunResult(steps, self._clock() - start)

    def _loop(self, start: float, end_ns: float, monitor: RateMonitor) -> None:
        world, clock, period, max_lag = self.world, self._clock, self._period, self._max_lag
        timekeeper = world.timekeeper
        due = start
        window = self._new_window(start)
        while not self._stopped and timekeeper.sim_time_ns < end_ns:
            begin = clock()
            if self._period != period:
                # What was due at the old rate no longer matters.
                period, due = self._period, begin
                window = self._new_window(begin)
                monitor.reset()
            world.step()
            end = clock()
            window.add(end - begin)
            if end - window.start >= self._report_period:
                self._finish(window, end)
                window = self._new_window(end)
            if period:
                monitor.add(end - begin, end)
                due += period
                if world.paused:
                    due = max(due, end)
                elif end - due > max(max_lag, period):
                    monitor.lose(end - due - max_lag, period, end)
                    due = end - max_lag
                self._wait_until(due, period)
            elif world.paused:
                self._wait_until(end + _PAUSED_CYCLE, period)

    def _wait_until(self, due: float, period: float) -> None:
        """Waits for a time of the wall clock and carries out requests meanwhile.

        Returns early when one of them changes the period.
        """
        while not self._stopped and self._period == period:
            left = due - self._clock()
            if left <= 0:
                return
            if self._wait(self._wake, min(left, _LONGEST_WAIT)):
                self._wake.clear()
                self.world.requests.process()

    def _new_window(self, now: float) -> CycleWindow:
        timekeeper, period = self.world.timekeeper, self._period
        target = timekeeper.step_size / period if period else math.inf
        return CycleWindow(period or timekeeper.step_size, target, now, timekeeper.sim_time_ns)

    def _finish(self, window: CycleWindow, now: float) -> None:
        """Reports a window, unless the world stood still in it."""
        now_ns = self.world.timekeeper.sim_time_ns
        if self._report is not None and now_ns > window.start_ns:
            self._report(window.statistics(now, now_ns))


def _period_of(update_rate: float) -> float:
    """Returns the wall time between two steps [s], 0 for as little as possible.

    Raises:
        ValueError: The rate is negative or not a number.
    """
    if math.isnan(update_rate) or update_rate < 0:
        raise ValueError(f"update_rate must not be negative, got {update_rate}")
    return 0.0 if update_rate == 0 else 1.0 / update_rate
