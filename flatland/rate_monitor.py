"""Detects that a loop does not hold its rate and warns with the names of expensive plugins."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from flatland.plugin_costs import PluginCosts
from flatland.world import World

_LOG = logging.getLogger("flatland")

SHORTEST_WATCH: Final = 1.0  # s of wall time that a warning is based on, at least
LONGEST_WATCH: Final = 10.0  # s of wall time without a warning that end a measurement
WARNING_PERIOD: Final = 60.0  # s of wall time from a warning to the next measurement
_NEGLIGIBLE: Final = 0.01  # share of the wall time that may be lost without a warning


@dataclass(slots=True)
class _Watch:
    """A measurement in progress."""

    costs: PluginCosts
    start: float  # s of wall time
    start_ns: int  # simulated time [ns]
    start_processor: float  # s of processor time
    worked: float = 0.0  # s spent in steps
    lost: float = 0.0  # s that were not made up for


class RateMonitor:
    """Warns when a loop keeps losing time.

    Timing each hook costs some percent of a step, so plugins are only measured from the first loss
    on. A warning needs a second loss `SHORTEST_WATCH` or more after the first one: a single long
    load or a stop in a debugger gives none.
    """

    def __init__(self, world: World, clock: Callable[[], float]) -> None:
        """Measures nothing yet.

        Args:
            world: The world that the loop steps.
            clock: Returns the wall time [s].
        """
        self._world = world
        self._clock = clock
        self._watch: _Watch | None = None
        self._silent_until = -math.inf

    def lose(self, lost: float, period: float, now: float) -> None:
        """Records a loss of time; called in the thread of the loop between two steps.

        Args:
            lost: Wall time that is not made up for [s].
            period: Wall time between two steps that the loop should hold [s].
            now: The present wall time [s].
        """
        watch = self._watch
        if watch is None:
            if now >= self._silent_until:
                self._start(now)
            return
        watch.lost += lost
        elapsed = now - watch.start
        if elapsed >= SHORTEST_WATCH and watch.lost > _NEGLIGIBLE * elapsed:
            self._warn(watch, elapsed, period)
            self._silent_until = now + WARNING_PERIOD
            self._end()

    def add(self, worked: float, now: float) -> None:
        """Records a step.

        Args:
            worked: Wall time of the step [s].
            now: The present wall time [s].
        """
        if self._watch is not None:
            self._watch.worked += worked
            if now - self._watch.start > LONGEST_WATCH:
                self._end()

    def reset(self) -> None:
        """Ends a measurement and forgets the last warning; for a change of the rate."""
        self._end()
        self._silent_until = -math.inf

    def _start(self, now: float) -> None:
        costs = PluginCosts(self._clock)
        self._world.measure_plugins(costs)
        self._watch = _Watch(
            costs, now, self._world.timekeeper.sim_time_ns, start_processor=time.thread_time()
        )

    def _end(self) -> None:
        if self._watch is not None:
            self._watch = None
            self._world.measure_plugins(None)

    def _warn(self, watch: _Watch, elapsed: float, period: float) -> None:
        timekeeper = self._world.timekeeper
        steps = (timekeeper.sim_time_ns - watch.start_ns) / timekeeper.step_size_ns
        percent = 100.0 / elapsed
        _LOG.warning(
            "the update rate of %g Hz cannot be held: %.1f steps a second for %.1f s. Steps take "
            "%.0f %% of the wall time, and the loop has a processor for %.0f %% of it. The most "
            "expensive plugins: %s",
            1.0 / period,
            steps / elapsed,
            elapsed,
            watch.worked * percent,
            (time.thread_time() - watch.start_processor) * percent,
            watch.costs.describe(elapsed),
        )
