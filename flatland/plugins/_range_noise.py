"""Noise models of range finders, applied to all ranges of a scan at once.

A range of NaN is that of a beam without a hit. The models draw single-precision numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from flatland.geometry import BoolArray, FloatArray
from flatland.plugin_api.parameters import read_not_negative

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader

NOISE_MODELS: Final = ("additive", "proportional", "beam")
SHARE_TOLERANCE: Final = 1e-6  # by which the sum of the shares may differ from 1
BEAM_KEYS: Final = ("z_hit", "z_short", "z_max", "z_rand", "sigma_hit", "lambda_short")
MAX_DEVIATION: Final = 1e6  # m; the greatest range of a laser
MAX_LAMBDA: Final = 1e6  # 1/m; a mean of one micrometre


class RangeNoise(Protocol):
    """A noise model."""

    def apply(self, ranges: FloatArray, rng: np.random.Generator) -> BoolArray | None:
        """Changes exact ranges to measured ones.

        Args:
            ranges: Exact range of each beam [m], shape (n,); NaN without a hit; overwritten.
            rng: Generator of the random numbers.

        Returns:
            Whether each range is still a measurement of what the beam hit, shape (n,); None if all
            of them are.
        """


class GaussianRangeNoise:
    """Adds normal noise with a constant standard deviation, or one proportional to the range."""

    def __init__(self, deviation: float, *, is_proportional: bool = False) -> None:
        """Creates the model.

        Args:
            deviation: Standard deviation [m], or its ratio to the range [m/m].
            is_proportional: Whether the deviation is a ratio.
        """
        self._deviation = np.float32(deviation)
        self._is_proportional = is_proportional

    def apply(self, ranges: FloatArray, rng: np.random.Generator) -> None:
        """Adds the noise to all ranges; NaN remains NaN."""
        noise = rng.standard_normal(ranges.shape, dtype=np.float32)
        noise *= self._deviation
        if self._is_proportional:
            noise *= ranges
        ranges += noise


class BeamModel:
    """The beam model of range finders.

    Each reading is of one of four kinds, at random: a hit with normal noise, truncated to the
    ranges that the sensor can report; a short reading caused by an object that is not in the world,
    with an exponential distribution from 0 to the exact range; a missed reading; or a random one,
    with a uniform distribution from 0 to the maximum range. The exact range of a beam without a hit
    is the maximum range, and its "hit" is a miss.

    Source: S. Thrun, W. Burgard, D. Fox, *Probabilistic Robotics* (2005), section 6.3.1, equations
    6.4 to 6.12.
    """

    def __init__(
        self,
        shares: tuple[float, float, float, float],
        sigma_hit: float,
        lambda_short: float,
        max_range: float,
    ) -> None:
        """Creates the model.

        Args:
            shares: Shares of hits, short, missed and random readings; their sum is 1.
            sigma_hit: Standard deviation of hits [m], at most the maximum range.
            lambda_short: Parameter of the exponential distribution of short readings [1/m].
            max_range: Maximum range of the sensor [m].
        """
        cumulative = np.cumsum(shares)
        # Exactly 1 at the end, so that a kind with a share of 0 never occurs.
        self._thresholds = (cumulative / cumulative[-1])[:3]
        self._sigma = np.float32(sigma_hit)
        self._lambda = lambda_short
        self._max_range = np.float32(max_range)

    def apply(self, ranges: FloatArray, rng: np.random.Generator) -> BoolArray:
        """Replaces each range by a reading of one of the four kinds."""
        kinds = np.searchsorted(
            self._thresholds, rng.random(ranges.shape, dtype=np.float32), side="right"
        )
        is_hit: BoolArray = kinds == 0
        if self._sigma:
            measured = is_hit & ~np.isnan(ranges)
            ranges[measured] = self._hits(ranges[measured], rng)
        is_short = kinds == 1
        ranges[is_short] = self._short(ranges[is_short], rng)
        ranges[kinds == 2] = np.nan
        is_random = kinds == 3
        count = int(np.count_nonzero(is_random))
        ranges[is_random] = rng.random(count, dtype=np.float32) * self._max_range
        return is_hit

    def _hits(self, exact: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draws from the normal distribution around each range, truncated to the sensor's range."""
        readings = np.empty_like(exact)
        # Rejection: as the deviation is at most the maximum range, a draw is accepted with a
        # probability of more than 0.34.
        pending = np.arange(len(exact))
        while len(pending):
            draws = rng.standard_normal(len(pending), dtype=np.float32) * self._sigma
            draws += exact[pending]
            accepted = (draws >= 0) & (draws <= self._max_range)
            readings[pending[accepted]] = draws[accepted]
            pending = pending[~accepted]
        return readings

    def _short(self, exact: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draws from the exponential distribution, truncated to each range."""
        limit = np.where(np.isnan(exact), self._max_range, exact).astype(np.float64)
        # Inverse of the cumulative distribution.
        uniform = rng.random(len(exact))
        readings = -np.log1p(uniform * np.expm1(-self._lambda * limit)) / self._lambda
        rounded: FloatArray = readings.astype(np.float32)
        return rounded


def read_range_noise(config: YamlReader, max_range: float) -> RangeNoise | None:
    """Reads the parameters of the noise of a range finder.

    Args:
        config: Parameters of the plugin.
        max_range: Maximum range of the sensor [m].

    Returns:
        The model, None for no noise.

    Raises:
        YamlError: A parameter is invalid, or belongs to another model.
    """
    name: str = config.get("noise_model", "string", "additive")
    if name not in NOISE_MODELS:
        raise config.invalid(
            "noise_model", f"must be one of: {', '.join(NOISE_MODELS)}, got {name}"
        )
    if name == "beam":
        if "noise_std_dev" in config:
            raise config.invalid("noise_std_dev", "not used by the noise model beam: use sigma_hit")
        return _read_beam_model(config, max_range)
    for key in BEAM_KEYS:
        if key in config:
            raise config.invalid(key, 'only used with "noise_model: beam"')
    is_proportional = name == "proportional"
    deviation = read_not_negative(config, "noise_std_dev", 0.0)
    limit, unit = (1.0, "times the range") if is_proportional else (MAX_DEVIATION, "m")
    if deviation > limit:
        raise config.invalid("noise_std_dev", f"must be at most {limit:g} {unit}, got {deviation}")
    return GaussianRangeNoise(deviation, is_proportional=is_proportional) if deviation else None


def _read_beam_model(config: YamlReader, max_range: float) -> BeamModel:
    short, missed, random = (
        config.get(key, "float", 0.0, minimum=0, maximum=1)
        for key in ("z_short", "z_max", "z_rand")
    )
    rest = 1.0 - (short + missed + random)
    hit: float = config.get("z_hit", "float", max(0.0, rest), minimum=0, maximum=1)
    if abs(hit - rest) > SHARE_TOLERANCE:
        raise config.invalid(
            "z_hit",
            "z_hit + z_short + z_max + z_rand must be 1, "
            f"got {hit:g} + {short:g} + {missed:g} + {random:g} = {hit + 1.0 - rest:.9g}",
        )
    sigma = config.get("sigma_hit", "float", 0.0, minimum=0)
    if sigma > max_range:
        raise config.invalid(
            "sigma_hit", f'must be at most the "range", {max_range:g} m, got {sigma}'
        )
    if short and "lambda_short" not in config:
        raise config.invalid("z_short", 'requires "lambda_short"')
    rate = config.get("lambda_short", "float", 1.0)
    if not 0 < rate <= MAX_LAMBDA:
        raise config.invalid(
            "lambda_short", f"must be greater than 0 and at most {MAX_LAMBDA:g} 1/m, got {rate}"
        )
    return BeamModel((hit, short, missed, random), sigma, rate, max_range)
