"""Penner's easing curves: the acceleration profiles of a motion between two poses.

A curve maps progress in [0, 1] to the covered fraction of the path. It is exactly 0 and 1 at the
ends; back and elastic curves leave [0, 1] in between.
"""

from __future__ import annotations

import math
from collections.abc import Callable

Easing = Callable[[float], float]

_OVERSHOOT = 1.70158
_IN_OUT_OVERSHOOT = _OVERSHOOT * 1.525
_PERIOD = 0.3
_IN_OUT_PERIOD = _PERIOD * 1.5


def _linear(p: float) -> float:
    return p


def _power(exponent: int) -> Easing:
    def ease_in(p: float) -> float:
        eased: float = p**exponent
        return eased

    return ease_in


def _exponential(p: float) -> float:
    return math.exp2(10.0 * (p - 1.0))


def _circular(p: float) -> float:
    return 1.0 - math.sqrt(1.0 - p * p)


def _back(overshoot: float) -> Easing:
    def ease_in(p: float) -> float:
        return p * p * ((overshoot + 1.0) * p - overshoot)

    return ease_in


def _elastic(period: float) -> Easing:
    def ease_in(p: float) -> float:
        phase = (p - 1.0 - period / 4.0) * math.tau / period
        return -_exponential(p) * math.sin(phase)

    return ease_in


# The parabolas of a bouncing ball: end time, time of the apex, and drop of the apex below that of
# the first one. Times are in units of 1 / 2.75 of the duration.
_BOUNCES = ((1.0, 0.0, 0.0), (2.0, 1.5, 0.75), (2.5, 2.25, 0.9375), (math.inf, 2.625, 0.984375))


def _bounce(p: float) -> float:
    t = 2.75 * (1.0 - p)
    top, drop = next((top, drop) for end, top, drop in _BOUNCES if t < end)
    return 1.0 - ((t - top) ** 2 + drop)


def _mirrored(ease_in: Easing) -> Easing:
    """Returns the Out curve of an In curve."""
    return lambda p: 1.0 - ease_in(1.0 - p)


def _joined(ease_in: Easing) -> Easing:
    """Returns the InOut curve of an In curve: its scaled copy, then the mirror image of that."""
    return lambda p: ease_in(2.0 * p) / 2.0 if p < 0.5 else 1.0 - ease_in(2.0 - 2.0 * p) / 2.0


def _exact(ease: Easing) -> Easing:
    """Pins a curve to 0 and 1 at its ends, which some formulas only approximate."""

    def pinned(p: float) -> float:
        if p <= 0.0:
            return 0.0
        return 1.0 if p >= 1.0 else ease(p)

    return pinned


# By name: the In curve, and the In curve from which InOut is composed.
_FAMILIES: dict[str, tuple[Easing, Easing]] = {
    "quadratic": (_power(2), _power(2)),
    "cubic": (_power(3), _power(3)),
    "quartic": (_power(4), _power(4)),
    "quintic": (_power(5), _power(5)),
    "exponential": (_exponential, _exponential),
    "circular": (_circular, _circular),
    "back": (_back(_OVERSHOOT), _back(_IN_OUT_OVERSHOOT)),
    "elastic": (_elastic(_PERIOD), _elastic(_IN_OUT_PERIOD)),
    "bounce": (_bounce, _bounce),
}


def _all_easings() -> dict[str, Easing]:
    easings = {"linear": _exact(_linear)}
    for name, (ease_in, half) in _FAMILIES.items():
        easings[f"{name}In"] = _exact(ease_in)
        easings[f"{name}Out"] = _exact(_mirrored(ease_in))
        easings[f"{name}InOut"] = _exact(_joined(half))
    return easings


EASINGS: dict[str, Easing] = _all_easings()
"""All curves by name, such as `cubicInOut`."""
