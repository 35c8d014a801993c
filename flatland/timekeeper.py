"""Simulated time, kept as integer nanoseconds so that it never drifts."""

from __future__ import annotations

NANOSECONDS = 1_000_000_000


# What Box2D's solver can be asked for [s].
LEAST_STEP, GREATEST_STEP = 1e-6, 1000.0


class Timekeeper:
    """Holds the simulated time and the size of a step.

    Attributes:
        sim_time_ns: Simulated time since the start [ns].
        step_size: Simulated time of one step [s].
        step_size_ns: The same [ns], exact.
    """

    # Plain attributes, as they are read many times in every step.
    __slots__ = ("sim_time_ns", "step_size", "step_size_ns")

    def __init__(self, step_size: float = 0.005) -> None:
        """Starts at time 0.

        Args:
            step_size: Simulated time of one step [s], from 1e-6 to 1000; rounded to nanoseconds.

        Raises:
            ValueError: The step size is out of its range or not a number.
        """
        if not LEAST_STEP <= step_size <= GREATEST_STEP:
            raise ValueError(
                f"step_size must be from {LEAST_STEP:g} to {GREATEST_STEP:g} s, got {step_size}"
            )
        self.step_size_ns = round(step_size * NANOSECONDS)
        self.step_size = self.step_size_ns / NANOSECONDS
        self.sim_time_ns = 0

    @property
    def sim_time(self) -> float:
        """Simulated time [s]."""
        return self.sim_time_ns / NANOSECONDS

    @property
    def max_step_size(self) -> float:
        """Longest step that may come [s]; the same as `step_size`, steps being of one size."""
        return self.step_size

    def advance(self) -> None:
        """Moves the time on by one step."""
        self.sim_time_ns += self.step_size_ns
