"""Sensor noise that is reproducible and independent of subscribers."""

from __future__ import annotations

import logging
import math
import secrets
from collections.abc import Sequence

import numpy as np

_LOG = logging.getLogger("flatland")


def checked_seed(seed: int | None) -> int:
    """Returns a seed; draws and logs one for None.

    Raises:
        ValueError: The seed is negative.
    """
    if seed is None:
        seed = secrets.randbits(31)
        _LOG.info("seed %d drawn at random; use it as the seed to repeat this run", seed)
    if seed < 0:
        raise ValueError(f"seed must not be negative, got {seed}")
    return seed


class NoiseStream:
    """Random numbers of one output, a function of the seed and of the number of updates due.

    The generator is counter-based (Philox): each update owns a range of counters. The numbers of an
    update are therefore the same whether or not those of earlier updates were drawn, and depend
    neither on the subscribers of an output nor on the time at which they connect.

    Attributes:
        updates: Number of updates that were due.
    """

    __slots__ = ("_bits", "_counter", "_is_positioned", "_rng", "_state", "updates")

    def __init__(self, entropy: Sequence[int]) -> None:
        """Creates the stream; `begin_update` precedes the first draw.

        Args:
            entropy: Integers of at least 0 that identify the stream.
        """
        self._bits = np.random.Philox(np.random.SeedSequence(entropy))
        self._rng = np.random.Generator(self._bits)
        self._state = self._bits.state
        self._counter = self._state["state"]["counter"]
        self._is_positioned = False
        self.updates = 0

    def begin_update(self, count: int = 1) -> None:
        """Advances to the next update; to be called for each update due, emitted or not.

        Args:
            count: Number of updates that were due.
        """
        self.updates += count
        self._is_positioned = False

    @property
    def rng(self) -> np.random.Generator:
        """The generator, at the start of the current update or after the draws of this update."""
        if not self._is_positioned:
            self._is_positioned = True
            # The lowest word is the counter of the draws within an update.
            self._counter[1] = self.updates
            self._bits.state = self._state
        return self._rng


class GaussianNoise:
    """Independent normal noise of several quantities of one output.

    A quantity of variance 0 draws no number.
    """

    __slots__ = ("_deviations", "_stream")

    def __init__(self, stream: NoiseStream, variances: Sequence[float]) -> None:
        """Creates the noise.

        Args:
            stream: The stream of the output.
            variances: Variance of each quantity, at least 0.
        """
        self._stream = stream
        self._deviations = tuple(math.sqrt(variance) for variance in variances)

    def __bool__(self) -> bool:
        """Returns whether any quantity has noise."""
        return any(self._deviations)

    def begin_update(self, count: int = 1) -> None:
        """Advances to the next update; to be called for each update due, emitted or not.

        Args:
            count: Number of updates that were due.
        """
        self._stream.begin_update(count)

    def sample(self, index: int) -> float:
        """Returns the noise of one quantity; to be called once per quantity and update."""
        deviation = self._deviations[index]
        return float(self._stream.rng.normal(0.0, deviation)) if deviation else 0.0
