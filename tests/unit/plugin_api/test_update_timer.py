from __future__ import annotations

import math
from fractions import Fraction

import pytest

from flatland.plugin_api.update_timer import UpdateTimer
from flatland.timekeeper import Timekeeper


def fired_steps(rate: float, step_size: float, steps: int, start: int = 0) -> list[int]:
    timekeeper = Timekeeper(step_size)
    timekeeper.sim_time_ns = start * timekeeper.step_size_ns
    timer = UpdateTimer(rate)
    fired = []
    for step in range(start, start + steps):
        if timer.check_update(timekeeper):
            fired.append(step)
        timekeeper.advance()
    return fired


def test_rates_above_the_step_rate_fire_in_every_step() -> None:
    assert UpdateTimer().rate == math.inf
    for rate in (201.0, 1000.0, math.inf):
        assert fired_steps(rate, 0.005, 1000) == list(range(1000))


def test_rate_zero_fires_at_time_zero_only() -> None:
    assert fired_steps(0.0, 0.005, 1000) == [0]


@pytest.mark.parametrize("hours", [1, 24, 10_000])
def test_40_hz_at_5_ms_fires_every_fifth_step_for_hours(hours: int) -> None:
    start = hours * 3600 * 200
    assert fired_steps(40.0, 0.005, 1000, start) == list(range(start, start + 1000, 5))


@pytest.mark.parametrize("rate", [0.37, 7.0, 33.3, 199.0, 200.0])
@pytest.mark.parametrize("step_size", [0.001, 0.0033, 0.005])
def test_updates_are_exactly_rate_times_time(rate: float, step_size: float) -> None:
    steps = 10_000
    for start in (0, 720_000):
        due = Fraction(str(rate)) * Fraction(str(step_size)) * steps
        assert abs(len(fired_steps(rate, step_size, steps, start)) - min(due, steps)) < 2


@pytest.mark.parametrize("rate", [7.0, 30.0, 60.0])
def test_updates_agree_with_the_formula_of_the_reference(rate: float) -> None:
    dt = 0.005
    expected = [k for k in range(1000) if math.fmod(k * dt + dt / 2, 1 / rate) < dt]
    assert fired_steps(rate, dt, 1000) == expected


@pytest.mark.parametrize("rate", [-1.0, -math.inf, math.nan])
def test_negative_or_nan_rate_raises(rate: float) -> None:
    with pytest.raises(ValueError, match="rate must not be negative or NaN"):
        UpdateTimer(rate)
