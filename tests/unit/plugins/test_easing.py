"""Easing curves: names, end values and shapes."""

from __future__ import annotations

import math

import pytest

from flatland.plugins._easing import EASINGS

FAMILIES = (
    "quadratic",
    "cubic",
    "quartic",
    "quintic",
    "exponential",
    "circular",
    "back",
    "elastic",
    "bounce",
)


def test_there_are_28_easings() -> None:
    expected = {f"{family}{kind}" for family in FAMILIES for kind in ("In", "Out", "InOut")}
    assert set(EASINGS) == expected | {"linear"}
    assert len(EASINGS) == 28


@pytest.mark.parametrize("name", EASINGS)
def test_end_values_are_exact(name: str) -> None:
    assert EASINGS[name](0.0) == 0.0
    assert EASINGS[name](1.0) == 1.0


@pytest.mark.parametrize("family", FAMILIES)
def test_out_is_the_mirror_image_of_in(family: str) -> None:
    for p in (0.05, 0.3, 0.5, 0.77, 0.95):
        assert EASINGS[f"{family}Out"](p) == pytest.approx(1 - EASINGS[f"{family}In"](1 - p))


@pytest.mark.parametrize("family", FAMILIES)
def test_in_out_is_point_symmetric(family: str) -> None:
    ease = EASINGS[f"{family}InOut"]
    assert ease(0.5) == pytest.approx(0.5)
    for p in (0.05, 0.2, 0.4):
        assert ease(p) == pytest.approx(1 - ease(1 - p))


@pytest.mark.parametrize(
    ("name", "p", "value"),
    [
        ("linear", 0.3, 0.3),
        ("quadraticIn", 0.5, 0.25),
        ("quadraticInOut", 0.25, 0.125),
        ("cubicIn", 0.5, 0.125),
        ("quarticOut", 0.5, 1 - 0.5**4),
        ("quinticIn", 0.5, 0.5**5),
        ("exponentialIn", 0.5, 2**-5),
        ("exponentialOut", 0.5, 1 - 2**-5),
        ("circularIn", 0.6, 0.2),
        ("circularOut", 0.4, 0.8),
        # The overshoot of 10 %, at the minimum.
        ("backIn", 0.5, 0.25 * (2.70158 * 0.5 - 1.70158)),
        ("backInOut", 0.25, 0.125 * (3.5949095 * 0.5 - 2.5949095)),
        ("elasticIn", 0.7, 2**-3 * 1.0),
        ("elasticInOut", 0.45, 0.5 * 2**-1 * -math.sin((-0.1 - 0.1125) * math.tau / 0.45)),
        ("bounceOut", 1 / 2.75 / 2, 7.5625 * (1 / 5.5) ** 2),
        ("bounceOut", 1.5 / 2.75, 0.75),
        ("bounceOut", 2.25 / 2.75, 0.9375),
        ("bounceOut", 2.625 / 2.75, 0.984375),
        ("bounceIn", 1 - 1.5 / 2.75, 0.25),
    ],
)
def test_known_values(name: str, p: float, value: float) -> None:
    assert EASINGS[name](p) == pytest.approx(value, abs=1e-12)
