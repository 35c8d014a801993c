"""Measures how fast the simulated time passes."""

from __future__ import annotations

from collections import deque
from typing import Final

WINDOW: Final = 1.5  # s of wall time that the measurement looks back


class RealTimeFactor:
    """Simulated time over wall time, of the last one and a half seconds."""

    def __init__(self) -> None:
        """Starts without a measurement."""
        self._samples: deque[tuple[float, float]] = deque()

    def add(self, simulated: float, wall: float) -> float | None:
        """Adds a look at both clocks [s].

        Returns:
            The factor, None until there is enough to tell.
        """
        samples = self._samples
        if samples and simulated < samples[-1][0]:
            samples.clear()  # Another simulator, which began anew.
        samples.append((simulated, wall))
        while len(samples) > 2 and wall - samples[1][1] >= WINDOW:
            samples.popleft()
        passed = wall - samples[0][1]
        return (simulated - samples[0][0]) / passed if passed >= WINDOW / 3 else None
