"""Detects that a loop does not hold its rate and warns with the names of expensive plugins."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from flatland.runtime.plugin_costs import PluginCosts
from flatland.world import World

_LOG = logging.getLogger("flatland")

SHORTEST_WATCH: Final = 1.0  # s of wall time that a decision is based on, at least
LONGEST_WATCH: Final = 10.0  # s of wall time without a decision, after which a watch ends
WARNING_PERIOD: Final = 60.0  # s of wall time from a warning to the next watch
_NEGLIGIBLE: Final = 0.01  # share of the wall time that may be lost without a warning


@dataclass(slots=True)
class _Watch:
    """A stretch of time that starts with a loss."""

    start: float  # s of wall time
    start_ns: int  # simulated time [ns]
    lost: float = 0.0  # s that were not made up for, without the loss at the start


@dataclass(slots=True)
class _Measurement(_Watch):
    """A watch in which the plugins are measured."""

    costs: PluginCosts = field(default_factory=PluginCosts)
    rate: float = 0.0  # steps in a second of wall time before the measurement
    start_processor: float = field(default_factory=time.thread_time)  # s
    worked: float = 0.0  # s spent in steps


class RateMonitor:
    """Warns when a loop keeps losing time.

    The first loss starts a watch. Another loss `SHORTEST_WATCH` or more later shows that the rate
    is not held, whereas a single long load or a stop in a debugger is forgotten. Only then are the
    plugins measured, which makes a step of cheap plugins some 10 to 30 % slower, until a third loss
    leads to the warning: a second in a minute when the loop is overloaded, otherwise never.
    """

    def __init__(self, world: World, clock: Callable[[], float]) -> None:
        """Watches nothing yet.

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
                self._watch = _Watch(now, self._world.timekeeper.sim_time_ns)
            return
        watch.lost += lost
        elapsed = now - watch.start
        if elapsed < SHORTEST_WATCH or watch.lost <= _NEGLIGIBLE * elapsed:
            return
        if isinstance(watch, _Measurement):
            self._warn(watch, elapsed, 1.0 / period)
            self._end()
            self._silent_until = now + WARNING_PERIOD
        else:
            timekeeper = self._world.timekeeper
            now_ns = timekeeper.sim_time_ns
            rate = (now_ns - watch.start_ns) / timekeeper.step_size_ns / elapsed
            costs = PluginCosts(self._clock)
            self._world.plugin_host.measure(costs)
            self._watch = _Measurement(now, now_ns, costs=costs, rate=rate)

    def add(self, worked: float, now: float) -> None:
        """Records a step.

        Args:
            worked: Wall time of the step [s].
            now: The present wall time [s].
        """
        watch = self._watch
        if watch is None:
            return
        if isinstance(watch, _Measurement):
            watch.worked += worked
        if now - watch.start > LONGEST_WATCH:
            self._end()

    def reset(self) -> None:
        """Ends a watch and forgets the last warning; for a change of the rate."""
        self._end()
        self._silent_until = -math.inf

    def _end(self) -> None:
        if isinstance(self._watch, _Measurement):
            self._world.plugin_host.measure(None)
        self._watch = None

    @staticmethod
    def _warn(measured: _Measurement, elapsed: float, rate: float) -> None:
        percent = 100.0 / elapsed
        _LOG.warning(
            "the update rate of %g Hz cannot be held: %.1f steps a second. Steps take %.0f %% of "
            "the wall time, and the loop has a processor for %.0f %% of it. The most expensive "
            "plugins, in percent of the wall time: %s",
            rate,
            measured.rate,
            measured.worked * percent,
            (time.thread_time() - measured.start_processor) * percent,
            measured.costs.describe(elapsed),
        )
