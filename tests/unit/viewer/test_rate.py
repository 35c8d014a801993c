"""The scale of the rate slider, and how fast time passes."""

from __future__ import annotations

import math

import pytest

from flatland.viewer import rate_scale
from flatland.viewer.real_time_factor import RealTimeFactor


def test_each_position_comes_back_from_its_rate() -> None:
    for step_size in (0.005, 0.01, 0.0003):
        rates = [rate_scale.rate_at(i, step_size) for i in range(rate_scale.FASTEST)]
        assert rates == sorted(rates)
        positions = [rate_scale.position_of(rate, step_size) for rate in rates]
        assert positions == list(range(rate_scale.FASTEST))
    assert rate_scale.rate_at(rate_scale.FASTEST, 0.005) == 0.0
    assert rate_scale.position_of(0.0, 0.005) == rate_scale.FASTEST
    assert rate_scale.position_of(math.inf, 0.005) == rate_scale.FASTEST


def test_rates_are_round_numbers() -> None:
    assert rate_scale.rate_at(rate_scale.FACTORS.index(1.0), 0.005) == 200.0
    assert rate_scale.rate_at(rate_scale.FACTORS.index(0.3), 0.005) == 60.0


def test_rates_between_and_beyond_are_shown_nearby() -> None:
    one = rate_scale.FACTORS.index(1.0)
    assert rate_scale.position_of(210.0, 0.005) == one
    assert rate_scale.position_of(1e-6, 0.005) == 0
    assert rate_scale.position_of(1e9, 0.005) == rate_scale.FASTEST - 1


@pytest.mark.parametrize(
    ("rate", "words"),
    [
        (200.0, "200 Hz (x1)"),
        (10.0, "10 Hz (x0.05)"),
        (123.456, "123.5 Hz (x0.617)"),
        (0.0, "as fast as possible"),
        (math.inf, "as fast as possible"),
    ],
)
def test_rates_in_words(rate: float, words: str) -> None:
    assert rate_scale.describe(rate, 0.005) == words


def test_factor_needs_some_time() -> None:
    factor = RealTimeFactor()
    assert factor.add(10.0, 100.0) is None
    assert factor.add(10.2, 100.1) is None
    assert factor.add(11.4, 100.7) == pytest.approx(2.0)


def test_factor_forgets_what_is_long_ago() -> None:
    factor = RealTimeFactor()
    measured = [factor.add(min(0.1 * i, 2.0), 0.1 * i) for i in range(60)]
    assert measured[15] == pytest.approx(1.0)
    assert measured[-1] == pytest.approx(0.0)


def test_factor_begins_anew_with_the_simulator() -> None:
    factor = RealTimeFactor()
    factor.add(100.0, 0.0)
    factor.add(101.0, 1.0)
    assert factor.add(0.5, 1.1) is None
    assert factor.add(1.5, 2.1) == pytest.approx(1.0)
