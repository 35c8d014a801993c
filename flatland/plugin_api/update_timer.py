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

    __slots__ = ("_always", "_cycle", "_idle_from", "_idle_until", "_per_nanosecond", "rate")

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
        # No update is due at times [ns] from the first to before the second.
        self._idle_from = self._idle_until = 0
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
        now = timekeeper.sim_time_ns
        if self._idle_from <= now < self._idle_until:
            return False
        weight = self._per_nanosecond
        if weight == 0:
            return now == 0
        # fmod(t + dt / 2, period) < dt, all of it times 2 / period * cycle.
        step = timekeeper.step_size_ns
        phase = (2 * now + step) * weight % (2 * self._cycle)
        is_due = phase < 2 * step * weight
        # A step later the phase is past what is due, up to where it starts again.
        self._idle_from = now + step if is_due else now
        self._idle_until = now + (2 * self._cycle - phase + 2 * weight - 1) // (2 * weight)
        return is_due
