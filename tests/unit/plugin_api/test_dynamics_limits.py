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


@pytest.mark.parametrize("limit", [0.0, math.inf])
def test_without_limits_the_target_is_reached_at_once(limit: float) -> None:
    limits = DynamicsLimits(limit, limit, limit)
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


@pytest.mark.parametrize(("deceleration", "reached"), [(None, 0.8), (0.0, 0.0), (5.0, 0.5)])
def test_deceleration_limit(deceleration: float | None, reached: float) -> None:
    """By default, it is the acceleration limit; 0 means no limit."""
    limits = DynamicsLimits(acceleration_limit=2.0, deceleration_limit=deceleration)
    assert limits.limit(1.0, 0.0, 0.1) == pytest.approx(reached)


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


@pytest.mark.parametrize("value", [-0.1, math.nan, -math.inf])
@pytest.mark.parametrize("name", ["velocity_limit", "acceleration_limit", "deceleration_limit"])
def test_invalid_limit_raises(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} must not be negative or NaN"):
        DynamicsLimits(**{name: value})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{}", (0, 0, 0)),
        ("limits: {}", (0, 0, 0)),
        ("limits: {acceleration_limit: 2.5}", (0, 2.5, 2.5)),
        (
            "limits: {velocity_limit: 1, acceleration_limit: 2.5, deceleration_limit: 3}",
            (1, 2.5, 3),
        ),
    ],
)
def test_limits_of_a_file(text: str, expected: tuple[float, ...]) -> None:
    reader = YamlReader.from_string(text).optional_subnode("limits", "map")
    assert DynamicsLimits.from_config(reader).as_tuple() == expected


@pytest.mark.parametrize("key", ["velocity_limit", "acceleration_limit", "deceleration_limit"])
@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{}: -1", 'Invalid "{}", must not be negative'),
        ("{}: .nan", 'Invalid "{}", must not be negative or NaN'),
        ("{}: 1, top_speed: 1", "top_speed"),
    ],
)
def test_errors_of_a_file(key: str, entry: str, message: str) -> None:
    reader = YamlReader.from_string(f"{{{entry.format(key)}}}")
    with pytest.raises(YamlError, match=message.format(key)):
        DynamicsLimits.from_config(reader)
