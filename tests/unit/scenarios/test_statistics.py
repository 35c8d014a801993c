from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from flatland.scenarios.statistics import (
    bootstrap_interval,
    holm_adjusted,
    mcnemar_test,
    wilcoxon_test,
    wilson_interval,
)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    # From the formula in the paper, computed by hand.
    [
        (0, 10, 0.0, 0.2775),
        (5, 10, 0.2366, 0.7634),
        (10, 10, 0.7225, 1.0),
        (81, 263, 0.2553, 0.3662),
    ],
)
def test_wilson_interval(successes, trials, low, high):
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=1e-4)


def test_intervals_without_values():
    assert all(map(math.isnan, (*wilson_interval(0, 0), *bootstrap_interval([]))))


def test_bootstrap_interval_contains_the_mean_and_is_reproducible():
    values = np.random.default_rng(1).normal(3, 1, 400).tolist()
    low, high = bootstrap_interval(values)
    assert (low, high) == bootstrap_interval(values)
    # The normal approximation of the same interval.
    assert (low, high) == pytest.approx((3 - 0.098, 3 + 0.098), abs=0.12)
    assert high - low == pytest.approx(2 * 1.96 / 20, rel=0.15)


@pytest.mark.parametrize(
    ("gains", "losses", "p"), [(0, 0, 1.0), (3, 3, 1.0), (0, 6, 2 / 64), (1, 9, 22 / 1024)]
)
def test_mcnemar_test(gains, losses, p):
    assert mcnemar_test(gains, losses) == pytest.approx(p)
    assert mcnemar_test(losses, gains) == pytest.approx(p)


def brute_force(differences):
    """Returns the p-value from all signs of the ranks."""
    sizes = np.abs(differences)
    ranks = np.array([(sizes < s).sum() + ((sizes == s).sum() + 1) / 2 for s in sizes])
    total = ranks.sum()
    found = abs(ranks[np.array(differences) > 0].sum() - total / 2)
    signs = itertools.product((0, 1), repeat=len(ranks))
    extreme = [abs(np.dot(one, ranks) - total / 2) >= found - 1e-9 for one in signs]
    return sum(extreme) / len(extreme)


@pytest.mark.parametrize(
    "differences", [[1, 2, 3, 4, 5], [1, -2, 3, 4, 5, 6], [1, 1, 2, 2, -2, 3, 3.5], [-1, -1, -1, 2]]
)
def test_wilcoxon_test_is_exact_also_with_ties(differences):
    assert wilcoxon_test(differences) == pytest.approx(brute_force(differences))


def test_wilcoxon_test_of_the_data_of_darwin():
    heights = [6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75]
    assert wilcoxon_test(heights) == pytest.approx(0.041260, abs=1e-6)
    assert wilcoxon_test([*heights, 0, 0]) == wilcoxon_test(heights)


def test_wilcoxon_test_approximates_many_pairs():
    rng = np.random.default_rng(3)
    differences = rng.normal(0.15, 1, 200).tolist()
    exact = wilcoxon_test(differences)
    # One more pair crosses the limit of the exact test.
    assert wilcoxon_test([*differences, 1e-9]) == pytest.approx(exact, abs=0.01)
    assert wilcoxon_test([0.0] * 5) == 1.0


def test_holm_adjusted():
    assert holm_adjusted([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm_adjusted([]) == []
