"""The scale of the rate slider and the measurement of the real-time factor."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("PyQt5.QtWidgets", reason="PyQt5 is not installed")
pytest.importorskip("rospy", reason="ROS is not installed")

from flatland.viewer.status_bar import (
    RATE_FACTORS,
    UNLIMITED_POSITION,
    RealTimeFactor,
    format_rate,
    position_of_rate,
    rate_at_position,
)


def test_position_and_rate_round_trip() -> None:
    for step_size in (0.005, 0.01, 0.0003):
        rates = [rate_at_position(i, step_size) for i in range(UNLIMITED_POSITION)]
        assert rates == sorted(rates)
        positions = [position_of_rate(rate, step_size) for rate in rates]
        assert positions == list(range(UNLIMITED_POSITION))
    assert rate_at_position(UNLIMITED_POSITION, 0.005) == 0.0
    assert position_of_rate(0.0, 0.005) == UNLIMITED_POSITION
    assert position_of_rate(math.inf, 0.005) == UNLIMITED_POSITION


def test_rates_have_no_rounding_errors() -> None:
    assert rate_at_position(RATE_FACTORS.index(1.0), 0.005) == 200.0
    assert rate_at_position(RATE_FACTORS.index(0.3), 0.005) == 60.0


def test_other_rates_map_to_the_nearest_position() -> None:
    assert position_of_rate(210.0, 0.005) == RATE_FACTORS.index(1.0)
    assert position_of_rate(1e-6, 0.005) == 0
    assert position_of_rate(1e9, 0.005) == UNLIMITED_POSITION - 1


@pytest.mark.parametrize(
    ("rate", "text"),
    [
        (200.0, "200 Hz (x1)"),
        (10.0, "10 Hz (x0.05)"),
        (123.456, "123.5 Hz (x0.617)"),
        (0.0, "as fast as possible"),
        (math.inf, "as fast as possible"),
    ],
)
def test_format_rate(rate: float, text: str) -> None:
    assert format_rate(rate, 0.005) == text


def test_real_time_factor_needs_samples_over_a_third_of_the_window() -> None:
    factor = RealTimeFactor()
    assert factor.add(10.0, 100.0) is None
    assert factor.add(10.2, 100.1) is None
    assert factor.add(11.4, 100.7) == pytest.approx(2.0)


def test_real_time_factor_discards_samples_outside_the_window() -> None:
    factor = RealTimeFactor()
    measured = [factor.add(min(0.1 * i, 2.0), 0.1 * i) for i in range(60)]
    assert measured[15] == pytest.approx(1.0)
    assert measured[-1] == pytest.approx(0.0)


def test_real_time_factor_is_reset_when_the_simulated_time_jumps_back() -> None:
    factor = RealTimeFactor()
    factor.add(100.0, 0.0)
    factor.add(101.0, 1.0)
    assert factor.add(0.5, 1.1) is None
    assert factor.add(1.5, 2.1) == pytest.approx(1.0)
