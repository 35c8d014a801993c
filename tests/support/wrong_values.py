"""Values that functions refuse, and texts that their errors must not contain."""

from __future__ import annotations

import math
import re
from typing import Final

import numpy as np

HUGE: Final = 10**400
NO_NUMBERS: Final = ("3", True, None, [1], 1j, b"1", {"a": 1}, np.array([1.0, 2.0]))
NO_COUNTS: Final = (*NO_NUMBERS, -1, 1.5, math.nan, -HUGE, np.float64(2.0))
NO_POSES: Final = (
    "123",
    ("1", 2, 3),
    (1, 2, 3, 4),
    (1j, 0, 0),
    (True, 0, 0),
    None,
    5,
    {1, 2, 3},
    (HUGE, 0, 0),
    (math.nan, 0, 0),
    np.eye(3),
    ([1], 2, 3),
)
NO_PATHS: Final = (None, 5, [1], b"a")
# The texts of Python itself and of pybind11.
INTERNAL: Final = re.compile(
    r"object (is|has|of)|not supported between|incompatible function|cannot convert|expected str"
    r"|unpack|invalid literal|could not convert|must be real number|too large to|can't|iterable"
    r"|no attribute|subscriptable"
)
