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


def resolution_of(range_max: float) -> float:
    """Returns the resolution of the codes of a sensor [m].

    Args:
        range_max: Maximum range of the sensor [m].

    Returns:
        The range of the code 1, representable as float32; 0 if the ranges have no codes, because
        they would be coarser than `MAX_RESOLUTION`.
    """
    resolution = range_max / _STEPS
    return float(np.float32(resolution)) if resolution <= MAX_RESOLUTION else 0.0


def codes_of(ranges: FloatArray, resolutions: FloatArray, range_max: DoubleArray) -> Codes:
    """Returns the codes of ranges: the nearest multiples of the resolution.

    Args:
        ranges: Range of each beam [m], shape (k, n).
        resolutions: Resolution of each scan, returned by `resolution_of` [m], shape (k,).
        range_max: Maximum range of each scan [m], shape (k,).
    """
    steps = np.rint(ranges / resolutions[:, np.newaxis])
    # False for NaN. A beam without a hit can have the maximum range, rounded to float32.
    is_hit = ranges < range_max.astype(np.float32)[:, np.newaxis]
    codes: Codes = np.where(is_hit, np.clip(steps, 0, _LARGEST), NO_HIT).astype(np.uint16)
    codes[np.isneginf(ranges)] = TOO_CLOSE
    return codes
