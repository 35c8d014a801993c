"""Conversion of values of outputs and commands to JSON, and access to the numbers in values."""

from __future__ import annotations

import dataclasses
import math
import typing
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from flatland.errors import PLUGIN_FAULTS
from flatland.plugin_api.ports import Output

_MAX_ITEMS: Final = 16  # items of a list that are shown to users
_MAX_LISTED: Final = 8  # length of a list up to which its numbers can be plotted
_MAX_DEPTH: Final = 4
_MAX_TEXT: Final = 200  # characters


def as_json(value: object, depth: int = 0) -> Any:
    """Converts a value to JSON; a long list is shortened, and its length is appended."""
    if value is None or isinstance(value, bool | str):
        return value[:_MAX_TEXT] if isinstance(value, str) else value
    if isinstance(value, int | float | np.number):
        number = value.item() if isinstance(value, np.number) else value
        return number if math.isfinite(number) else str(number)
    if depth >= _MAX_DEPTH:
        return "…"
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            f.name: as_json(getattr(value, f.name), depth + 1) for f in dataclasses.fields(value)
        }
    if isinstance(value, Mapping):
        return {str(k): as_json(v, depth + 1) for k, v in list(value.items())[:_MAX_ITEMS]}
    if isinstance(value, np.ndarray | list | tuple):
        items = [as_json(item, depth + 1) for item in value[:_MAX_ITEMS]]
        return items if len(value) <= _MAX_ITEMS else [*items, f"… {len(value)} items"]
    return str(value)[:_MAX_TEXT]


def number_at(value: object, path: Iterable[str]) -> float | None:
    """Returns the number at a path of names and indices in a value, None if it does not exist."""
    for part in path:
        if dataclasses.is_dataclass(value) and part in {f.name for f in dataclasses.fields(value)}:
            value = getattr(value, part)
        elif isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(value, np.ndarray | list | tuple) and part.isdecimal() and len(part) < 8:
            index = int(part)
            if index >= len(value):
                return None
            value = value[index]
        else:
            return None
    if isinstance(value, bool | np.bool_):
        return float(value)
    if isinstance(value, int | float | np.number):
        try:
            number = float(value)
        except OverflowError:
            return None
        return number if math.isfinite(number) else None
    return None


def find_number(
    outputs: Mapping[str, Output[Any]], name: str
) -> tuple[Output[Any], list[str]] | None:
    """Returns the output of a series and the path in its values, None if it does not exist.

    Args:
        outputs: Outputs by topic.
        name: Name of the series: a topic, and names and indices, joined by slashes.
    """
    parts = name.split("/")
    for count in range(len(parts), 0, -1):
        output = outputs.get("/".join(parts[:count]))
        if output is not None:
            return output, parts[count:]
    return None


def series_of(output: Output[Any]) -> list[str]:
    """Returns the names of the numbers of an output, from the latest value or the type."""
    if output.latest is not None:
        paths = _paths_of_value(output.latest)
    else:
        paths = _paths_of_type(output.value_type)
    return ["/".join((output.topic, *path)) for path in paths]


def _paths_of_value(value: object, depth: int = 0) -> Iterator[tuple[str, ...]]:
    if isinstance(value, bool | np.bool_ | int | float | np.number):
        yield ()
        return
    children: Iterable[tuple[str, object]] = ()
    if depth >= _MAX_DEPTH:
        return
    if dataclasses.is_dataclass(value):
        children = [(f.name, getattr(value, f.name)) for f in dataclasses.fields(value)]
    elif isinstance(value, Mapping):
        children = [(str(key), item) for key, item in list(value.items())[:_MAX_ITEMS]]
    elif isinstance(value, np.ndarray | list | tuple) and len(value) <= _MAX_LISTED:
        children = [(str(index), item) for index, item in enumerate(value)]
    for name, item in children:
        for path in _paths_of_value(item, depth + 1):
            if not (depth == 0 and name == "stamp"):
                yield (name, *path)


def _paths_of_type(kind: object, depth: int = 0) -> Iterator[tuple[str, ...]]:
    if kind in (bool, int, float):
        yield ()
    elif depth >= _MAX_DEPTH:
        return
    elif typing.get_origin(kind) is tuple and Ellipsis not in typing.get_args(kind):
        for index, item in enumerate(typing.get_args(kind)):
            for path in _paths_of_type(item, depth + 1):
                yield (str(index), *path)
    elif isinstance(kind, type) and dataclasses.is_dataclass(kind):
        try:
            hints = typing.get_type_hints(kind)
        except PLUGIN_FAULTS:  # The type refers to names that exist only for type checkers.
            return
        for field in dataclasses.fields(kind):
            for path in _paths_of_type(hints.get(field.name), depth + 1):
                if not (depth == 0 and field.name == "stamp"):
                    yield (field.name, *path)
