from __future__ import annotations

import math

import pytest

from flatland import YamlError, YamlReader
from flatland.plugin_api.dynamics_limits import DynamicsLimits


def run(limits: DynamicsLimits, v: float, target: float, dt: float, steps: int) -> list[float]:
    velocities = []
    for _ in range(steps):
        v = limits.limit(v, target, dt)
        velocities.append(v)
    return velocities


def test_without_limits_the_target_is_reached_at_once() -> None:
    limits = DynamicsLimits()
    assert limits.limit(0.0, 3.0, 0.01) == 3.0
    assert limits.limit(3.0, -3.0, 0.01) == -3.0
    assert limits.limit(-3.0, 0.0, 0.01) == 0.0


@pytest.mark.parametrize(("target", "reached"), [(3.0, 2.0), (-3.0, -2.0), (1.5, 1.5)])
def test_velocity_limit_holds_in_both_directions(target: float, reached: float) -> None:
    assert DynamicsLimits(velocity_limit=2.0).limit(0.0, target, 0.01) == reached


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_acceleration_limit_holds_away_from_zero(sign: float) -> None:
    limits = DynamicsLimits(acceleration_limit=2.0, deceleration_limit=5.0)
    assert run(limits, 0.0, sign * 0.5, 0.1, 4) == pytest.approx(
        [sign * 0.2, sign * 0.4, sign * 0.5, sign * 0.5]
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_deceleration_limit_holds_towards_zero(sign: float) -> None:
    limits = DynamicsLimits(acceleration_limit=2.0, deceleration_limit=5.0)
    assert run(limits, sign * 1.2, 0.0, 0.1, 4) == pytest.approx([sign * 0.7, sign * 0.2, 0.0, 0.0])
    assert limits.limit(sign * 1.2, sign * 1.0, 0.1) == sign * 1.0


def test_default_deceleration_limit_is_the_acceleration_limit() -> None:
    limits = DynamicsLimits(acceleration_limit=2.0)
    assert limits.deceleration_limit == 2.0
    assert limits.limit(1.0, 0.0, 0.1) == pytest.approx(0.8)


def test_deceleration_limit_of_zero_means_no_limit() -> None:
    limits = DynamicsLimits(acceleration_limit=2.0, deceleration_limit=0.0)
    assert limits.limit(1.0, 0.0, 0.1) == 0.0


def test_velocity_above_a_limit_decelerates_to_it() -> None:
    limits = DynamicsLimits(velocity_limit=1.0, deceleration_limit=2.0)
    assert limits.limit(3.0, 5.0, 0.1) == pytest.approx(2.8)


@pytest.mark.parametrize("sign", [1.0, -1.0])
class TestCrossingZero:
    def test_without_deceleration_limit_acceleration_starts_at_zero(self, sign: float) -> None:
        limits = DynamicsLimits(acceleration_limit=2.0, deceleration_limit=0.0)
        assert limits.limit(sign * 3.0, sign * -5.0, 0.1) == pytest.approx(sign * -0.2)
        assert limits.limit(sign * 3.0, sign * -0.1, 0.1) == pytest.approx(sign * -0.1)

    def test_deceleration_limit_holds_until_the_sign_changes(self, sign: float) -> None:
        limits = DynamicsLimits(acceleration_limit=2.0, deceleration_limit=5.0)
        assert limits.limit(sign * 0.6, sign * -1.0, 0.1) == pytest.approx(sign * 0.1)

    def test_both_limits_apply_in_the_crossing_step(self, sign: float) -> None:
        limits = DynamicsLimits(acceleration_limit=2.0, deceleration_limit=5.0)
        # 0.02 s at 5 m/s² until standstill, the remaining 0.08 s at 2 m/s².
        assert limits.limit(sign * 0.1, sign * -1.0, 0.1) == pytest.approx(sign * -0.16)
        assert limits.limit(sign * 0.1, sign * -0.05, 0.1) == pytest.approx(sign * -0.05)

    def test_without_acceleration_limit_the_crossing_step_is_unlimited(self, sign: float) -> None:
        limits = DynamicsLimits(acceleration_limit=0.0, deceleration_limit=5.0)
        assert limits.limit(sign * 0.6, sign * -1.0, 0.1) == pytest.approx(sign * 0.1)
        assert limits.limit(sign * 0.1, sign * -1.0, 0.1) == pytest.approx(sign * -1.0)


def test_infinite_limit_means_no_limit() -> None:
    limits = DynamicsLimits(math.inf, math.inf, math.inf)
    assert limits.limit(-1.0, 7.0, 0.1) == 7.0


@pytest.mark.parametrize("value", [-0.1, math.nan, -math.inf])
@pytest.mark.parametrize("name", ["velocity_limit", "acceleration_limit", "deceleration_limit"])
def test_invalid_limit_raises(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} must not be negative or NaN"):
        DynamicsLimits(**{name: value})


class TestFromConfig:
    def read(self, text: str) -> DynamicsLimits:
        reader = YamlReader.from_string(text)
        return DynamicsLimits.from_config(reader.optional_subnode("limits", "map"))

    def test_missing_map_means_no_limits(self) -> None:
        limits = self.read("{}")
        assert limits.limit(0.0, 100.0, 0.01) == 100.0

    def test_all_keys_are_read(self) -> None:
        limits = self.read(
            "limits: {velocity_limit: 1, acceleration_limit: 2.5, deceleration_limit: 3}"
        )
        assert limits.velocity_limit == 1.0
        assert limits.acceleration_limit == 2.5
        assert limits.deceleration_limit == 3.0

    def test_deceleration_defaults_to_acceleration(self) -> None:
        assert self.read("limits: {acceleration_limit: 2.5}").deceleration_limit == 2.5
        assert self.read("limits: {}").deceleration_limit == 0.0

    @pytest.mark.parametrize("key", ["velocity_limit", "acceleration_limit", "deceleration_limit"])
    @pytest.mark.parametrize("value", ["-1", ".nan"])
    def test_negative_limit_is_an_error(self, key: str, value: str) -> None:
        with pytest.raises(YamlError, match=f'Invalid "{key}", must not be negative or NaN'):
            self.read(f"limits: {{{key}: {value}}}")

    def test_unknown_key_is_an_error(self) -> None:
        with pytest.raises(YamlError, match="top_speed"):
            self.read("limits: {top_speed: 1}")
