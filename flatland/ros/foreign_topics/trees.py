"""Messages as trees of values."""

from __future__ import annotations

import itertools
import math
from typing import Any, Final

import genpy
import numpy as np

MAX_ITEMS: Final = 16  # items of an array
MAX_VALUES: Final = 1000  # values of a message
_MAX_TEXT: Final = 500  # characters


def tree_of(message: Any) -> Any:
    """Returns a message as JSON: objects, lists, numbers and texts.

    A long array is shortened, and its length is appended. Numbers that are not finite are texts,
    stamps and durations are numbers [s].
    """
    return _tree(message, itertools.count())


def _tree(value: Any, count: itertools.count[int]) -> Any:
    if isinstance(value, genpy.Message):
        return {name: _tree(getattr(value, name), count) for name in value.__slots__}
    if isinstance(value, list | tuple | np.ndarray):
        items = [_tree(item, count) for item in value[:MAX_ITEMS]]
        return items if len(value) <= MAX_ITEMS else [*items, f"… {len(value)} items"]
    if next(count) >= MAX_VALUES:
        return "…"
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if isinstance(value, genpy.TVal):
        return value.to_sec()
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value[:_MAX_TEXT] if isinstance(value, str) else value
