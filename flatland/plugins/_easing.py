"""Penner's easing curves: the acceleration profiles of a motion between two poses.

A curve maps progress in [0, 1] to the covered fraction of the path. It is exactly 0 and 1 at the
ends; back and elastic curves leave [0, 1] in between.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

from flatland.physics import ease, easings

Easing = Callable[[float], float]

EASINGS: dict[str, Easing] = {name: functools.partial(ease, name) for name in easings()}
"""All curves by name, such as `cubicInOut`."""
