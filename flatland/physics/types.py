"""Types that the physics package shares."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

Pose = tuple[float, float, float]
Vector2 = tuple[float, float]
FloatArray = npt.NDArray[np.float32]
DoubleArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

ALL_BITS: Final = 0xFFFF
