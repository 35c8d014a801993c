"""Messages as trees of values."""

from __future__ import annotations

import array
import itertools
import math
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from flatland.timekeeper import NANOSECONDS

MAX_ITEMS: Final = 16  # items of an array
MAX_VALUES: Final = 1000  # values of a message
_MAX_TEXT: Final = 500  # characters


def tree_of(message: Any) -> Any:
    """Returns a message as JSON: objects, lists, numbers and texts.

    A long array is shortened, and its length is appended. Numbers that are not finite are texts,
    stamps and durations are numbers [s].
    """
    return _tree(message, itertools.count())


def nanoseconds_of(time: Any) -> int:
    """Returns a stamp or a duration of a message [ns]."""
    if hasattr(time, "nsecs"):  # ROS 1
        return int(time.secs) * NANOSECONDS + int(time.nsecs)
    return int(time.sec) * NANOSECONDS + int(time.nanosec)


def _field_names(value: Any) -> Iterable[str] | None:
    """Returns the names of the fields of a message, None for other values."""
    if hasattr(value, "_slot_types"):  # ROS 1
        return tuple(value.__slots__)
    fields = getattr(value, "get_fields_and_field_types", None)  # ROS 2
    return None if fields is None else fields()


def _tree(value: Any, count: itertools.count[int]) -> Any:
    is_time = hasattr(value, "nsecs") or hasattr(value, "nanosec")
    names = None if is_time else _field_names(value)
    if names is not None:
        return {name: _tree(getattr(value, name), count) for name in names}
    if isinstance(value, list | tuple | array.array | np.ndarray):
        items = [_tree(item, count) for item in value[:MAX_ITEMS]]
        return items if len(value) <= MAX_ITEMS else [*items, f"… {len(value)} items"]
    if next(count) >= MAX_VALUES:
        return "…"
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if is_time:
        return nanoseconds_of(value) / NANOSECONDS
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value[:_MAX_TEXT] if isinstance(value, str) else value
