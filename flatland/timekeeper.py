"""Simulated time, kept as integer nanoseconds so that it never drifts."""

from __future__ import annotations

import math

NANOSECONDS = 1_000_000_000


class Timekeeper:
    """Holds the simulated time and the size of a step."""

    __slots__ = ("_step_ns", "sim_time_ns")

    sim_time_ns: int
    """Simulated time since the start [ns]."""

    def __init__(self, step_size: float = 0.005) -> None:
        """Starts at time 0.

        Args:
            step_size: Simulated time of one step [s], at least 1 ns.

        Raises:
            ValueError: The step size is not a finite number of at least 1 ns.
        """
        if not (math.isfinite(step_size) and step_size * NANOSECONDS >= 1):
            raise ValueError(f"step_size must be finite and positive [s], got {step_size}")
        self._step_ns = round(step_size * NANOSECONDS)
        self.sim_time_ns = 0

    @property
    def sim_time(self) -> float:
        """Simulated time [s]."""
        return self.sim_time_ns / NANOSECONDS

    @property
    def step_size(self) -> float:
        """Simulated time of one step [s]."""
        return self._step_ns / NANOSECONDS

    @property
    def step_size_ns(self) -> int:
        """Simulated time of one step [ns], exact."""
        return self._step_ns

    @property
    def max_step_size(self) -> float:
        """Longest step that may come [s]; the same as `step_size`, steps being of one size."""
        return self.step_size

    def advance(self) -> None:
        """Moves the time on by one step."""
        self.sim_time_ns += self._step_ns
