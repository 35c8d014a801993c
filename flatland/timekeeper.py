"""Simulated time, stored as integer nanoseconds to avoid drift."""

from __future__ import annotations

from typing import Protocol

from flatland.checks import checked_range

NANOSECONDS = 1_000_000_000

MIN_STEP_SIZE = 1e-6
"""Smallest step of the Box2D solver [s]."""
MAX_STEP_SIZE = 1000.0
"""Largest step of the Box2D solver [s]."""


class SimulatedTime(Protocol):
    """What has the simulated time: a `flatland.physics.PhysicsWorld`.

    Attributes:
        time_ns: Simulated time [ns].
    """

    time_ns: int


class _OwnTime:
    """The simulated time of a timekeeper without a world."""

    __slots__ = ("time_ns",)

    def __init__(self) -> None:
        self.time_ns = 0


class Timekeeper:
    """The simulated time and the step size.

    Attributes:
        step_size: Simulated time of one step [s].
        step_size_ns: Simulated time of one step [ns], exact.
    """

    __slots__ = ("_time", "step_size", "step_size_ns")

    def __init__(self, step_size: float = 0.005, time: SimulatedTime | None = None) -> None:
        """Creates a timekeeper.

        Args:
            step_size: Simulated time of one step [s], from 1e-6 to 1000; rounded to nanoseconds.
            time: The physics world, which has the time; None for a time of its own.

        Raises:
            ValueError: The step size is out of range or NaN.
        """
        step_size = checked_range("step_size", step_size, MIN_STEP_SIZE, MAX_STEP_SIZE, "s")
        self.step_size_ns = round(step_size * NANOSECONDS)
        self.step_size = self.step_size_ns / NANOSECONDS
        self._time = _OwnTime() if time is None else time

    @property
    def sim_time_ns(self) -> int:
        """Simulated time since the start [ns]; settable."""
        return self._time.time_ns

    @sim_time_ns.setter
    def sim_time_ns(self, time_ns: int) -> None:
        self._time.time_ns = time_ns

    @property
    def sim_time(self) -> float:
        """Simulated time [s]."""
        return self.sim_time_ns / NANOSECONDS

    @property
    def max_step_size(self) -> float:
        """Longest possible step [s]; equal to `step_size`, because all steps have the same size."""
        return self.step_size

    def advance(self) -> None:
        """Advances the time by one step."""
        self.sim_time_ns += self.step_size_ns
