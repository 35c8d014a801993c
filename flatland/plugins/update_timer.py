"""When a plugin that works at a rate is due."""

from __future__ import annotations

import math
from fractions import Fraction

from flatland.timekeeper import NANOSECONDS, Timekeeper


class UpdateTimer:
    """Says in which steps an update at a given rate is due, on average exactly that often.

    Attributes:
        rate: [Hz]; infinity means every step, 0 at time 0 only.
    """

    __slots__ = ("_always", "_cycle", "_per_nanosecond", "rate")

    def __init__(self, rate: float = math.inf) -> None:
        """Makes a timer.

        Args:
            rate: [Hz].

        Raises:
            ValueError: The rate is negative or NaN.
        """
        if not rate >= 0:
            raise ValueError(f"rate must not be negative or NaN [Hz], got {rate}")
        self.rate = float(rate)
        self._always = math.isinf(rate)
        self._cycle = 0
        self._per_nanosecond = 0
        if not self._always:
            # The rate as it was written, 0.1 as 1/10: integers, so that nothing drifts in hours.
            exact = Fraction(repr(self.rate))
            self._per_nanosecond = exact.numerator
            self._cycle = NANOSECONDS * exact.denominator

    def check_update(self, timekeeper: Timekeeper) -> bool:
        """Tells whether an update is due at the present time.

        The time is asked with a tolerance of half a step on either side, so the answer depends on
        nothing but the time: two timers of one rate agree, whenever they were made.
        """
        if self._always:
            return True
        # fmod(t + dt / 2, period) < dt, all of it times 2 / period * cycle.
        weight = self._per_nanosecond
        step = timekeeper.step_size_ns
        if weight == 0:
            return timekeeper.sim_time_ns == 0
        phase = (2 * timekeeper.sim_time_ns + step) * weight % (2 * self._cycle)
        return phase < 2 * step * weight
