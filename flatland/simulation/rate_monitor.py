"""Detects that a loop does not hold its rate, and logs the most expensive plugins."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from flatland.runtime.plugin_costs import PluginCosts
from flatland.runtime.plugin_host import PluginHost
from flatland.timekeeper import Timekeeper

_LOG = logging.getLogger("flatland")

MIN_WATCH_TIME: Final = 1.0  # s of wall time before a decision
MAX_WATCH_TIME: Final = 10.0  # s of wall time without a decision, after which a watch ends
WARNING_PERIOD: Final = 60.0  # s of wall time from a warning to the next watch
_NEGLIGIBLE: Final = 0.01  # share of the wall time that may be lost without a warning


@dataclass(slots=True)
class _Watch:
    """A time interval that starts with a loss."""

    start: float  # s of wall time
    start_ns: int  # simulated time [ns]
    lost: float = 0.0  # s of dropped lag, without the loss at the start


@dataclass(slots=True)
class _Measurement(_Watch):
    """A watch during which the costs of plugins are measured."""

    costs: PluginCosts = field(default_factory=PluginCosts)
    rate: float = 0.0  # steps per second of wall time before the measurement
    start_cpu_time: float = field(default_factory=time.thread_time)  # s
    worked: float = 0.0  # s of wall time spent in steps


class RateMonitor:
    """Logs a warning if a loop repeatedly loses time.

    The first loss starts a watch. Another loss `MIN_WATCH_TIME` or more later shows that the rate
    is not held, whereas a single loss, such as a long load or a breakpoint, is ignored. Plugins are
    measured only from the second loss until the third one, which leads to the warning: about one
    second per minute if the loop is overloaded, otherwise never. The measurement makes a step of
    cheap plugins 10 to 30 % slower.
    """

    def __init__(
        self, timekeeper: Timekeeper, host: PluginHost, clock: Callable[[], float]
    ) -> None:
        """Creates a monitor without a watch.

        Args:
            timekeeper: Simulated time of the world that the loop steps.
            host: Measures the costs of the plugins.
            clock: Returns the wall time [s].
        """
        self._timekeeper = timekeeper
        self._host = host
        self._clock = clock
        self._watch: _Watch | None = None
        self._silent_until = -math.inf

    def lose(self, lost: float, period: float, now: float) -> None:
        """Records a loss of time; to be called in the thread of the loop between two steps.

        Args:
            lost: Dropped lag [s].
            period: Target wall time between two steps [s].
            now: Current wall time [s].
        """
        watch = self._watch
        if watch is None:
            if now >= self._silent_until:
                self._watch = _Watch(now, self._timekeeper.sim_time_ns)
            return
        watch.lost += lost
        elapsed = now - watch.start
        if elapsed < MIN_WATCH_TIME or watch.lost <= _NEGLIGIBLE * elapsed:
            return
        if isinstance(watch, _Measurement):
            self._warn(watch, elapsed, 1.0 / period)
            self._end()
            self._silent_until = now + WARNING_PERIOD
        else:
            now_ns = self._timekeeper.sim_time_ns
            rate = (now_ns - watch.start_ns) / self._timekeeper.step_size_ns / elapsed
            costs = PluginCosts(self._clock)
            self._host.costs = costs
            self._watch = _Measurement(now, now_ns, costs=costs, rate=rate)

    def add(self, worked: float, now: float) -> None:
        """Records a step.

        Args:
            worked: Wall time of the step [s].
            now: Current wall time [s].
        """
        watch = self._watch
        if watch is None:
            return
        if isinstance(watch, _Measurement):
            watch.worked += worked
        if now - watch.start > MAX_WATCH_TIME:
            self._end()

    def reset(self) -> None:
        """Ends the watch and allows a new warning; to be called when the rate changes."""
        self._end()
        self._silent_until = -math.inf

    def _end(self) -> None:
        if isinstance(self._watch, _Measurement):
            self._host.costs = None
        self._watch = None

    @staticmethod
    def _warn(measured: _Measurement, elapsed: float, rate: float) -> None:
        percent = 100.0 / elapsed
        _LOG.warning(
            "the update rate of %g Hz cannot be held: %.1f steps per second. Steps take %.0f %% of "
            "the wall time, and the CPU time of the loop is %.0f %% of it. The most expensive "
            "plugins, in percent of the wall time: %s",
            rate,
            measured.rate,
            measured.worked * percent,
            (time.thread_time() - measured.start_cpu_time) * percent,
            measured.costs.describe(elapsed),
        )
