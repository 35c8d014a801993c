"""Sensor noise that is reproducible and independent of subscribers."""

from __future__ import annotations

import logging
import math
import secrets
from collections.abc import Sequence

import numpy as np

from flatland.checks import checked_count

_LOG = logging.getLogger("flatland")


def checked_seed(seed: int | None) -> int:
    """Returns a seed; draws and logs one for None.

    Raises:
        ValueError: The seed is no integer, or negative.
    """
    if seed is None:
        seed = secrets.randbits(31)
        _LOG.info("seed %d drawn at random; use it as the seed to repeat this run", seed)
        return seed
    return checked_count("seed", seed, 0)


class NoiseStream:
    """Random numbers of one output, a function of the seed and of the number of updates due.

    The generator is counter-based (Philox): each update owns a range of counters. The numbers of an
    update are therefore the same whether or not earlier updates drew numbers, and depend
    neither on the subscribers of an output nor on the time at which they connect.

    Attributes:
        updates: Number of updates that were due.
    """

    __slots__ = ("_bits", "_entropy", "_is_positioned", "_key", "_rng", "_state", "updates")

    def __init__(self, entropy: Sequence[int]) -> None:
        """Creates the stream; `begin_update` precedes the first draw.

        Args:
            entropy: Integers of at least 0 that identify the stream.
        """
        self._entropy = tuple(entropy)
        self._key: int | None = None
        self._bits: np.random.Philox | None = None
        self._is_positioned = False
        self.updates = 0

    @property
    def key(self) -> int:
        """A 64-bit integer that identifies the stream, for generators of the core."""
        if self._key is None:
            seeds = np.random.SeedSequence(self._entropy)
            self._key = int(seeds.generate_state(1, np.uint64)[0])
        return self._key

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
        if self._bits is None:
            # Created when it is needed, since many streams draw no numbers.
            self._bits = np.random.Philox(np.random.SeedSequence(self._entropy))
            self._rng = np.random.Generator(self._bits)
            self._state = self._bits.state
        if not self._is_positioned:
            self._is_positioned = True
            # The lowest word is the counter of the draws within an update.
            self._state["state"]["counter"][1] = self.updates
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
