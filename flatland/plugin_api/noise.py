"""Gaussian noise from a plugin's own generator."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np


class GaussianNoise:
    """Independent noise of several quantities; one whose variance is 0 draws nothing."""

    __slots__ = ("_deviations", "_rng")

    def __init__(self, rng: np.random.Generator, variances: Sequence[float]) -> None:
        """Prepares to draw.

        Args:
            rng: The plugin's generator.
            variances: Of each quantity, not negative.
        """
        self._rng = rng
        self._deviations = tuple(math.sqrt(variance) for variance in variances)

    def __bool__(self) -> bool:
        """Whether there is any noise at all."""
        return any(self._deviations)

    def sample(self, index: int) -> float:
        """Draws the noise of one quantity."""
        deviation = self._deviations[index]
        return float(self._rng.normal(0.0, deviation)) if deviation else 0.0
