"""The scale of the rate slider: from slow motion to as fast as possible."""

from __future__ import annotations

import math
from typing import Final

FACTORS: Final = (
    *(0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7),
    *(1.0, 1.5, 2.0, 3.0, 5.0, 7.0),
    *(10.0, 15.0, 20.0, 30.0, 50.0),
)
"""Real-time factors at the slider's positions; one more stands for as fast as possible."""

FASTEST: Final = len(FACTORS)


def rate_at(position: int, step_size: float) -> float:
    """Returns the steps in a second [Hz] at a position of the slider, 0 at the last one."""
    # Twelve digits are more than the rate needs and hide what division leaves: 1 / 0.005.
    return 0.0 if position >= FASTEST else float(f"{FACTORS[position] / step_size:.12g}")


def position_of(rate: float, step_size: float) -> int:
    """Returns the position of the slider that is nearest to a rate [Hz]."""
    if rate == 0 or math.isinf(rate):
        return FASTEST
    wanted = math.log(rate * step_size)
    return min(range(FASTEST), key=lambda index: abs(math.log(FACTORS[index]) - wanted))


def describe(rate: float, step_size: float) -> str:
    """Says in words how fast a rate [Hz] is."""
    if rate == 0 or math.isinf(rate):
        return "as fast as possible"
    return f"{rate:.4g} Hz (x{rate * step_size:.3g})"
