"""Ranges of scans as integers of 16 bits, which halve the bandwidth of a client."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import DoubleArray, FloatArray

Codes = npt.NDArray[np.uint16]

NO_HIT: Final = 65535  # NaN, or at least the maximum range
TOO_CLOSE: Final = 65534  # -inf
_LARGEST: Final = 65533
_STEPS: Final = 65534  # of the maximum range
MAX_RESOLUTION: Final = 0.001
"""Largest resolution of codes [m], a fifth of the tolerance of contacts in Box2D. It is that of a
maximum range of 65 m; scans of a longer range are sent as float32."""


def has_codes(range_max: float) -> bool:
    """Returns whether the codes of a sensor are as fine as `MAX_RESOLUTION`.

    Args:
        range_max: Maximum range of the sensor [m].
    """
    return range_max <= MAX_RESOLUTION * _STEPS


def codes_of(ranges: FloatArray, range_max: DoubleArray) -> tuple[Codes, FloatArray]:
    """Returns the codes of ranges: the nearest multiples of the resolution of each scan.

    Args:
        ranges: Range of each beam [m], shape (k, n).
        range_max: Maximum range of each scan [m], for which `has_codes` is true, shape (k,).

    Returns:
        The codes, shape (k, n), and the resolutions [m], shape (k,).
    """
    resolutions: FloatArray = (range_max / _STEPS).astype(np.float32)
    steps = ranges * (1 / resolutions)[:, np.newaxis]
    steps += 0.5  # The conversion to integers rounds down.
    np.clip(steps, 0, _LARGEST, out=steps)
    # False for NaN. A beam without a hit can have the maximum range, rounded to float32.
    is_hit = ranges < range_max.astype(np.float32)[:, np.newaxis]
    codes: Codes = np.where(is_hit, steps, NO_HIT).astype(np.uint16)
    codes[np.isneginf(ranges)] = TOO_CLOSE
    return codes, resolutions
