"""The loop that steps a world in real time or as fast as possible until it is stopped."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Final, TypeVar

from flatland.checks import (
    check_kind,
    checked_count,
    checked_limit,
    checked_not_negative,
    checked_number,
    checked_positive,
    shown,
)
from flatland.defaults import MAX_LAG
from flatland.errors import WorldError
from flatland.physics import WorkTimes
from flatland.runtime.stepping import MAX_STEPS, Pace
from flatland.simulation.cycle_statistics import CycleStatistics, CycleWindow
from flatland.simulation.pause_holds import PauseHolds
from flatland.simulation.rate_monitor import RateMonitor
from flatland.simulation.step_requests import StepRequests
from flatland.timekeeper import NANOSECONDS, Timekeeper
from flatland.uncopied import uncopied
from flatland.world import World

_PAUSED_PERIOD: Final = 0.01  # s between two cycles of a paused world without a rate
# Without a rate, a cycle has up to this many steps, as long as they take less than this time [s].
_MAX_STEPS: Final = 256
_SHORT_CYCLE: Final = 1e-3
_MAX_WAIT: Final = 3600.0  # s; Python raises for a timeout of several centuries

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class RunResult:
    """The result of one run of the loop.

    Attributes:
        steps: Number of steps of the world.
        wall_time: Wall time of the run [s].
    """

    steps: int
    wall_time: float

    @property
    def steps_per_second(self) -> float:
        """Steps per second of wall time."""
        return self.steps / self.wall_time if self.wall_time > 0 else 0.0


class _Cycle:
    """The steps between two waits of the loop.

    Attributes:
        count: Number of steps.
        waited: Wall time that the core waited between them [s].
    """

    __slots__ = ("_times", "count", "waited")

    def __init__(self, count: int, times: WorkTimes | None = None) -> None:
        self.count = count
        self.waited = 0.0 if times is None else times.waited
        self._times = times

    def extremes(self, worked: float) -> tuple[float, float] | None:
        """Returns the wall times of the shortest and of the longest step [s].

        The time that was not spent in steps of the core belongs to the last step.

        Args:
            worked: Wall time of the cycle without waits [s].

        Returns:
            None if the steps are of the same length.
        """
        times = self._times
        if times is None or self.count < 2:
            return None
        return times.least, max(times.most, worked - times.total)


class _ElapsedTime:
    """The simulated time of a run [ns], which continues when a reset sets the clock back."""

    def __init__(self, timekeeper: Timekeeper) -> None:
        self._timekeeper = timekeeper
        self._last = timekeeper.sim_time_ns
        self._total = 0

    def update(self) -> int:
        """Returns the simulated time since the start [ns], without jumps back."""
        now = self._timekeeper.sim_time_ns
        self._total += max(now - self._last, 0)
        self._last = now
        return self._total


@uncopied("create another Simulation for a copy of the world, which World.clone() returns")
class Simulation:
    """Steps a world at a rate, in the thread that calls `run`.

    After a late cycle, the next cycles follow without a wait until the loop has caught up. The
    excess of a lag over `max_lag` is dropped, which bounds the burst of steps after a delay of any
    cause: a slow plugin, a long load, a debugger. A lag of up to one cycle is never dropped. A
    pause or a change of the rate resets the lag. If the loop repeatedly loses time, a warning names
    the most expensive plugins.

    In lockstep, time passes only on request: the loop waits for `request_steps` and carries out
    other requests meanwhile. Without it, requested steps are carried out in addition.

    Attributes:
        world: The world.
        lockstep: Whether time passes only on request.
        statistics: Statistics of the last report period in which the world was stepped, None
            before the end of the first one.
        lost_time: Lag that was dropped since the start [s of wall time].
        holds: Pause the world while clients drag models.
    """

    def __init__(
        self,
        world: World,
        update_rate: float = 200.0,
        *,
        max_lag: float = MAX_LAG,
        lockstep: bool = False,
        report: Callable[[CycleStatistics], None] | None = None,
        report_period: float = 1.0,
        clock: Callable[[], float] = time.perf_counter,
        wait: Callable[[threading.Event, float], bool] = threading.Event.wait,
    ) -> None:
        """Creates a simulation.

        Args:
            world: The world.
            update_rate: Steps per second of wall time [Hz]; 0 or inf for as many as possible.
            max_lag: Maximum lag that the loop catches up on [s]; at least one cycle is used.
            lockstep: Whether time passes only on request; the rate then has no meaning.
            report: Called with statistics while the world is not paused, not in lockstep.
            report_period: Wall time between two reports [s].
            clock: Returns the wall time [s].
            wait: Waits for an event for at most some wall time [s]; returns whether it is set.

        Raises:
            ValueError: The rate or the lag is negative or not a number, the lag is infinite, or the
                period is not positive.
            TypeError: `world` is no world.
        """
        check_kind("world", world, World, "a World")
        self.world = world
        self.lockstep = lockstep
        self.statistics: CycleStatistics | None = None
        self.lost_time = 0.0
        self.holds = PauseHolds(world)
        self._period = _period_of(update_rate)
        self._max_lag = checked_not_negative("max_lag", max_lag, "s")
        self._report = report
        self._report_period = checked_positive("report_period", report_period, "s")
        self._clock = clock
        self._wait = wait
        self._wake = threading.Event()
        # The core can wait between steps on the clock of this module only.
        self._is_real_time = clock is time.perf_counter and wait is threading.Event.wait
        self._stopped = False
        self._steps = StepRequests(world.stepping, world.timekeeper, clock)

    @property
    def stopped(self) -> bool:
        """Whether `stop` was called."""
        return self._stopped

    @property
    def rate(self) -> float:
        """Target steps per second of wall time [Hz], inf for as many as possible."""
        return 1.0 / self._period if self._period else math.inf

    def set_rate(self, update_rate: float) -> None:
        """Changes the rate from the next step on; to be called between two steps.

        Args:
            update_rate: Steps per second of wall time [Hz]; 0 or inf for as many as possible.

        Raises:
            ValueError: The rate is negative or not a number.
            WorldError: The simulation has no rate, because time passes only on request.
        """
        if self.lockstep:
            raise WorldError("the rate cannot be set in lockstep: time passes only on request")
        self._period = _period_of(update_rate)

    def stop(self) -> None:
        """Makes `run` return after the current step; safe from any thread."""
        self._stopped = True
        self._wake.set()
        self.world.physics.jobs.interrupt()

    def post(self, action: Callable[[], R]) -> Future[R]:
        """Queues an action that runs between two steps; safe from any thread, see `World.post`.

        The action runs without delay even if the loop waits or the world is paused.
        """
        return self.world.post(action)

    def request_steps(self, count: int) -> Future[int]:
        """Requests steps in addition to the steps of the loop; safe from any thread.

        The steps are carried out without delay and as fast as possible, after the steps that were
        requested before. Other requests are carried out in between. A paused world is stepped and
        stays paused. Cancelling the future withdraws the steps that are not done yet.

        Args:
            count: Number of steps, at least 1.

        Returns:
            Holds the simulated time after the last step [ns]; a `WorldError` if the simulation
            stops first.

        Raises:
            ValueError: `count` is no integer, or less than 1.
        """
        count = checked_count("count", count, 1, MAX_STEPS)
        done = self._steps.add(count)
        self._wake.set()
        self.world.physics.jobs.interrupt()
        if self._stopped:
            self._steps.fail()
        return done

    def run(self, duration: float = math.inf) -> RunResult:
        """Steps the world until `stop` is called or a simulated time has elapsed.

        Requests of other threads run in the calling thread meanwhile. A call of `request_steps` is
        completed even if it exceeds the simulated time.

        Args:
            duration: Simulated time of the run [s].

        Raises:
            WorldError: The world is closed, or another simulation runs it.
            ValueError: `duration` is negative or not a number.
        """
        duration = checked_limit("duration", duration, "s")
        timekeeper = self.world.timekeeper
        start, elapsed = self._clock(), _ElapsedTime(timekeeper)
        duration_ns = math.inf if math.isinf(duration) else round(duration * NANOSECONDS)
        monitor = RateMonitor(timekeeper, self.world.plugin_host, self._clock)
        try:
            with self.world.requests.serving(self._wake.set):
                if self.world.requests.actions:  # queued before, without a call of `_wake.set`
                    self._wake.set()
                self._loop(start, elapsed, duration_ns, monitor)
        finally:
            monitor.reset()
            if self._stopped:
                self._steps.fail()
        return RunResult(elapsed.update() // timekeeper.step_size_ns, self._clock() - start)

    def _loop(
        self, start: float, elapsed: _ElapsedTime, duration_ns: float, monitor: RateMonitor
    ) -> None:
        world, clock, period, max_lag = self.world, self._clock, self._period, self._max_lag
        timekeeper = world.timekeeper
        due = start
        window = self._new_window(start)
        steps = 1
        while not self._stopped and elapsed.update() < duration_ns:
            if self._steps:
                due += self._serve_steps()
            elif self.lockstep:
                self._wait_until(math.inf, period)
            if self.lockstep:
                continue
            begin = clock()
            if self._period != period or timekeeper.sim_time_ns < window.start_ns:
                # Due times of the old rate, or of the time before a reset, are void.
                period, due = self._period, begin
                window = self._new_window(begin)
                monitor.reset()
            left = (duration_ns - elapsed.update()) / timekeeper.step_size_ns
            if period:
                cycle = self._paced_cycle(due, period, left)
            else:
                cycle = _Cycle(world.stepping.step_up_to(steps))
            end = clock()
            worked = end - begin - cycle.waited
            window.add(worked, cycle.count, cycle.extremes(worked))
            if end - window.start >= self._report_period:
                self._finish(window, end)
                window = self._new_window(end)
            if period:
                monitor.add(worked, end)
                due += cycle.count * period
                if world.paused:
                    due = max(due, end)
                elif end - due > max(max_lag, period):
                    self.lost_time += end - due - max_lag
                    monitor.lose(end - due - max_lag, period, end)
                    due = end - max_lag
                due += self._wait_until(due, period)
                steps = 1
            elif world.paused:
                self._wait_until(end + _PAUSED_PERIOD, period)
            else:
                left = duration_ns - elapsed.update()
                steps = _next_steps(steps, worked, left / timekeeper.step_size_ns)

    def _paced_cycle(self, due: float, period: float, left: float) -> _Cycle:
        """Performs a step, and further ones in the core as long as no Python code is called.

        Args:
            due: Wall time at which the first step was due [s].
            period: Wall time between two steps [s].
            left: Number of steps to the end of the run, may be infinite.
        """
        if not self._is_real_time:
            self.world.step()
            return _Cycle(1)
        pace = Pace(due, period, self._wake.is_set)
        count = self.world.stepping.step_up_to(math.ceil(min(left, _MAX_STEPS)), pace)
        return _Cycle(count, pace.times)

    def _wait_until(self, due: float, period: float) -> float:
        """Waits until a wall time and runs requests meanwhile.

        Returns early if a request changes the period, and, in lockstep, after requested steps.

        Returns:
            Wall time of the requested steps, by which the wait was prolonged [s].
        """
        spent = 0.0
        while not self._stopped and self._period == period:
            left = due + spent - self._clock()
            if left <= 0:
                break
            if self._wait(self._wake, min(left, _MAX_WAIT)):
                self._wake.clear()
                self.world.requests.process()
                if self._steps:
                    spent += self._serve_steps()
                    if self.lockstep:
                        break
        return spent

    def _serve_steps(self) -> float:
        """Carries out the requested steps and returns their wall time [s]."""
        start = self._clock()
        self._steps.serve(lambda: self._stopped)
        return self._clock() - start

    def _new_window(self, now: float) -> CycleWindow:
        timekeeper, period = self.world.timekeeper, self._period
        target = timekeeper.step_size / period if period else math.inf
        return CycleWindow(period or timekeeper.step_size, target, now, timekeeper.sim_time_ns)

    def _finish(self, window: CycleWindow, now: float) -> None:
        """Reports a window, unless the world was not stepped in it."""
        now_ns = self.world.timekeeper.sim_time_ns
        if now_ns > window.start_ns:
            self.statistics = window.statistics(now, now_ns)
            if self._report is not None:
                self._report(self.statistics)


def _next_steps(steps: int, worked: float, left: float) -> int:
    """Returns how many steps without calls of plugins may follow each other in one cycle.

    Args:
        steps: The number for the last cycle.
        worked: Wall time of the last cycle [s].
        left: Number of steps to the end of the run, may be infinite.
    """
    steps = min(2 * steps, _MAX_STEPS) if worked < _SHORT_CYCLE else max(1, steps // 4)
    return max(1, min(steps, math.ceil(min(left, _MAX_STEPS))))


def _period_of(update_rate: float) -> float:
    """Returns the wall time between two steps [s], 0 for no limit of the rate.

    Raises:
        ValueError: The rate is negative or not a number.
    """
    rate = checked_number("update_rate", update_rate, "Hz")
    if math.isnan(rate) or rate < 0:
        raise ValueError(f"update_rate must not be negative, got {shown(update_rate)}")
    return 0.0 if rate == 0 else 1.0 / rate
