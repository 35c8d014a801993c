"""The timer of plugins that update at a rate."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Literal

from flatland.timekeeper import NANOSECONDS, Timekeeper

UpdateClock = tuple[Literal["periodic", "always", "at_start", "never"], int, int]
"""Kind, half step and cycle, see `flatland.physics.StepPlan.add_clock`."""


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
        if not rate >= 0:
            raise ValueError(f"rate must not be negative or NaN [Hz], got {rate}")
        self.rate = float(rate)
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

    def clock(self, step_size_ns: int) -> UpdateClock | None:
        """Returns the clock of the core that agrees with this timer.

        Args:
            step_size_ns: Simulated time of a step [ns]; all times are multiples of it.

        Returns:
            The clock; None if its numbers do not fit into 63 bits.
        """
        if self._always:
            return ("always", 0, 0)
        if self._per_nanosecond == 0:
            return ("at_start", 0, 0)
        # phase < 2 * step * weight in `check_update`, without the common divisor of all terms.
        half_step, cycle = step_size_ns * self._per_nanosecond, 2 * self._cycle
        divisor = math.gcd(half_step, cycle)
        half_step, cycle = half_step // divisor, cycle // divisor
        if 2 * half_step >= cycle:
            return ("always", 0, 0)
        return ("periodic", half_step, cycle) if cycle < 1 << 63 else None

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
            return now == 0
        # fmod(t + dt / 2, period) < dt, all of it times 2 / period * cycle.
        step = timekeeper.step_size_ns
        phase = (2 * now + step) * weight % (2 * self._cycle)
        is_due = phase < 2 * step * weight
        # From the next step on no update is due until the phase wraps around.
        self._idle_from = now + step if is_due else now
        self._idle_until = now + (2 * self._cycle - phase + 2 * weight - 1) // (2 * weight)
        return is_due
