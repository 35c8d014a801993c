"""The timer of plugins that update at a rate."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, Final

from flatland.checks import checked_limit
from flatland.timekeeper import NANOSECONDS, Timekeeper

if TYPE_CHECKING:
    from flatland.physics import Clock

_LARGEST_CYCLE: Final = 1 << 126


class UpdateTimer:
    """Determines the steps in which an update is due, on average at exactly the given rate.

    Attributes:
        rate: Update rate [Hz]; infinity means every step, 0 only time 0.
    """

    __slots__ = ("_always", "_cycle", "_idle_from", "_idle_until", "_per_nanosecond", "rate")

    def __init__(self, rate: float = math.inf) -> None:
        """Creates a timer.

        Args:
            rate: Update rate [Hz].

        Raises:
            ValueError: The rate is negative or NaN.
        """
        self.rate = checked_limit("rate", rate, "Hz")
        self._always = math.isinf(rate)
        self._cycle = 0
        self._per_nanosecond = 0
        # No update is due at times [ns] from the first to before the second.
        self._idle_from = self._idle_until = 0
        if not self._always:
            # The decimal value of the rate, 0.1 as 1/10, in integers, so that nothing drifts.
            exact = Fraction(repr(self.rate))
            self._per_nanosecond = exact.numerator
            self._cycle = NANOSECONDS * exact.denominator

    def clock(self, step_size_ns: int) -> Clock:
        """Returns the clock of the core that agrees with this timer, see `flatland.physics.Clock`.

        A subclass that overrides `check_update` alone has a clock that is due in every step.

        Args:
            step_size_ns: Simulated time of a step [ns].
        """
        if self._always or type(self).check_update is not UpdateTimer.check_update:
            return (1, 1)
        weight, cycle = self._per_nanosecond, 2 * self._cycle
        if weight == 0:
            return (1, _LARGEST_CYCLE)  # due at time 0 only
        divisor = math.gcd(weight, cycle)
        weight, cycle = weight // divisor, cycle // divisor
        if 2 * step_size_ns * weight >= cycle:
            return (1, 1)
        # With a longer cycle, the next update after time 0 is beyond the range of times.
        return (weight, min(cycle, _LARGEST_CYCLE))

    def check_update(self, timekeeper: Timekeeper) -> bool:
        """Returns whether an update is due at the current time.

        The time is compared with a tolerance of half a step on either side. The result depends on
        the time alone: timers of the same rate agree, whenever they were created.
        """
        if self._always:
            return True
        now = timekeeper.sim_time_ns
        if self._idle_from <= now < self._idle_until:
            return False
        weight = self._per_nanosecond
        if weight == 0:
            return 2 * now < timekeeper.step_size_ns
        # fmod(t + dt / 2, period) < dt, all of it times 2 / period * cycle.
        step = timekeeper.step_size_ns
        phase = (2 * now + step) * weight % (2 * self._cycle)
        is_due = phase < 2 * step * weight
        # From the next step on no update is due until the phase wraps around.
        self._idle_from = now + step if is_due else now
        self._idle_until = now + (2 * self._cycle - phase + 2 * weight - 1) // (2 * weight)
        return is_due
