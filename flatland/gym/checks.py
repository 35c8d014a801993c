"""Checks of arguments."""

from __future__ import annotations

import operator
from typing import SupportsIndex

import numpy as np


def checked_count(name: str, value: object, least: int = 1) -> int:
    """Returns an integer of Python for an integer of any type.

    Args:
        name: Name of the number, for the error.
        value: The number.
        least: Its least value.

    Raises:
        ValueError: It is no integer, or too small.
    """
    if isinstance(value, SupportsIndex) and not isinstance(value, bool | np.bool_):
        try:
            number = operator.index(value)
        except TypeError:  # an array with several numbers
            number = least - 1
        if number >= least:
            return number
    raise ValueError(f"{name} must be an integer of at least {least}, got {value!r}")
