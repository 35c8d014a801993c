"""Intervals and paired tests, without further packages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

_Z: Final = 1.959964  # 97.5 % quantile of the normal distribution
_RESAMPLES: Final = 2000
_BOOTSTRAP_SEED: Final = 0  # the same rows have the same interval
_MOST_DRAWS: Final = 1 << 14  # values of the resamples that are drawn at a time
_EXACT: Final = 200  # pairs up to which the distribution of the signed ranks is exact


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Returns the 95 % Wilson score interval of a rate; NaN without trials.

    See E. B. Wilson, "Probable Inference, the Law of Succession, and Statistical Inference",
    Journal of the American Statistical Association 22, 1927.
    """
    if not trials:
        return (math.nan, math.nan)
    rate = successes / trials
    scale = 1 + _Z**2 / trials
    center = (rate + _Z**2 / (2 * trials)) / scale
    half = _Z * math.sqrt(rate * (1 - rate) / trials + (_Z / (2 * trials)) ** 2) / scale
    # It contains the rate, apart from rounding.
    return (max(0.0, min(rate, center - half)), min(1.0, max(rate, center + half)))


def bootstrap_interval(values: Sequence[float]) -> tuple[float, float]:
    """Returns the 95 % percentile bootstrap interval of a mean; NaN for fewer than two values.

    See B. Efron, "Bootstrap Methods: Another Look at the Jackknife", Annals of Statistics 7, 1979.
    """
    if len(values) < 2:  # They do not show how much the values differ.
        return (math.nan, math.nan)
    numbers = np.asarray(values, float)
    rng = np.random.default_rng(_BOOTSTRAP_SEED)
    count = len(numbers)
    rows = max(1, _MOST_DRAWS // count)
    means = np.concatenate(
        [
            numbers[rng.integers(0, count, (min(rows, _RESAMPLES - first), count))].mean(axis=1)
            for first in range(0, _RESAMPLES, rows)
        ]
    )
    low, high = np.quantile(means, (0.025, 0.975)).tolist()
    return (low, high)


def mcnemar_test(gains: int, losses: int) -> float:
    """Returns the p-value of the exact two-sided test of McNemar for paired yes/no values.

    See Q. McNemar, "Note on the sampling error of the difference between correlated proportions",
    Psychometrika 12, 1947. It is the sign test of the pairs that differ.

    Args:
        gains: Number of pairs that changed from no to yes.
        losses: Number of pairs that changed from yes to no.
    """
    trials = gains + losses
    if not trials:
        return 1.0
    tail = sum(math.comb(trials, k) for k in range(min(gains, losses) + 1))
    return min(1.0, 2 * float(tail / 2**trials))


def wilcoxon_test(differences: Sequence[float]) -> float:
    """Returns the p-value of the two-sided signed-rank test of paired differences.

    See F. Wilcoxon, "Individual Comparisons by Ranking Methods", Biometrics Bulletin 1, 1945.
    Differences of 0 are dropped; equal ones share their mean rank. Up to 200 pairs, the
    distribution is exact, also with ties, otherwise that of the normal approximation.
    """
    numbers = np.asarray(differences, float)
    numbers = numbers[numbers != 0]
    count = len(numbers)
    if not count:
        return 1.0
    doubled = _doubled_ranks(np.abs(numbers))
    positive = int(doubled[numbers > 0].sum())
    total = int(doubled.sum())
    least = min(positive, total - positive)
    if count <= _EXACT:
        return min(1.0, 2 * _tail(doubled.tolist(), least))
    variance = float((doubled**2).sum()) / 4
    z = (least + 1 - total / 2) / math.sqrt(variance)  # with a correction for continuity
    return min(1.0, math.erfc(-z / math.sqrt(2)))


def _doubled_ranks(sizes: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Returns twice the rank of each number, an integer also for ties."""
    ordered = np.sort(sizes)
    first = np.searchsorted(ordered, sizes, "left")
    last = np.searchsorted(ordered, sizes, "right")
    return np.asarray(first + last + 1, np.int64)


def _tail(doubled: Sequence[int], least: int) -> float:
    """Returns the probability of at most `least` for the sum of the ranks with random signs."""
    probabilities = np.zeros(least + 1)
    probabilities[0] = 1.0
    for rank in doubled:
        shifted = np.zeros_like(probabilities)
        if rank <= least:
            shifted[rank:] = probabilities[: least + 1 - rank]
        probabilities = (probabilities + shifted) / 2
    return float(probabilities.sum())


def holm_adjusted(p_values: Sequence[float]) -> list[float]:
    """Returns p-values that are adjusted for the number of tests.

    See S. Holm, "A Simple Sequentially Rejective Multiple Test Procedure", Scandinavian Journal of
    Statistics 6, 1979.
    """
    order = sorted(range(len(p_values)), key=lambda index: p_values[index])
    adjusted, largest = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(order):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[index]))
        adjusted[index] = largest
    return adjusted
