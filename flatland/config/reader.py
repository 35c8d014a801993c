"""Typed reading of YAML values."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, Literal, TypeVar, Unpack, overload

from flatland.config import hints
from flatland.config.convert import (
    CONVERSIONS,
    TUPLE_SIZES,
    BoolKind,
    Color,
    FloatKind,
    IntKind,
    Key,
    Kind,
    Limits,
    ListLimits,
    ListSizes,
    StringKind,
    unmet_limit,
)
from flatland.config.node import ScalarNode
from flatland.config.preprocessor import Params
from flatland.config.tree_reader import TreeReader
from flatland.geometry import Pose, Vector2

D = TypeVar("D")
T = TypeVar("T")
REQUIRED = object()
"""Default of an entry that is required."""


ReadYaml = Callable[[str | os.PathLike[str], Params], "YamlReader"]
"""Loads a file, with the source of the values of `param(NAME)`."""


class YamlReader(TreeReader):
    """A node of a YAML file with its location, whose entries are read as typed values."""

    # The type of each kind of value, for type checkers.
    @overload
    def get(self, key: Key, kind: BoolKind, default: D = ...) -> bool | D: ...
    @overload
    def get(
        self, key: Key, kind: IntKind, default: D = ..., **limits: Unpack[Limits]
    ) -> int | D: ...
    @overload
    def get(
        self, key: Key, kind: FloatKind, default: D = ..., **limits: Unpack[Limits]
    ) -> float | D: ...
    @overload
    def get(self, key: Key, kind: StringKind, default: D = ...) -> str | D: ...
    @overload
    def get(
        self, key: Key, kind: Literal["vector"], default: D = ..., **limits: Unpack[Limits]
    ) -> Vector2 | D: ...
    @overload
    def get(
        self, key: Key, kind: Literal["pose"], default: D = ..., **limits: Unpack[Limits]
    ) -> Pose | D: ...
    @overload
    def get(
        self, key: Key, kind: Literal["color"], default: D = ..., **limits: Unpack[Limits]
    ) -> Color | D: ...

    def get(
        self, key: Key, kind: Kind, default: object = REQUIRED, **limits: Unpack[Limits]
    ) -> Any:
        """Reads an entry as one kind of value.

        Args:
            key: Key of a map or index of a list.
            kind: `string`, `float`, `int`, `bool` (or the Python type); `vector` for (x, y),
                `pose` for (x, y, theta), `color` for (r, g, b, a), all of floats.
            default: Returned unchecked if the entry is missing or empty; if omitted, the entry is
                required.
            **limits: Requirements of a number, or of each number of a vector, pose or colour:
                `finite=True` rejects infinity and NaN; `minimum` and `maximum` are inclusive limits
                and reject NaN.

        Raises:
            YamlError: The entry is missing, of another kind, or violates a limit.
        """
        if default is not REQUIRED and self._is_missing(key):
            return default
        entry = self._open(key)
        return entry._checked(entry._convert(kind), limits)

    @overload
    def value(self, kind: BoolKind) -> bool: ...
    @overload
    def value(self, kind: IntKind) -> int: ...
    @overload
    def value(self, kind: FloatKind) -> float: ...
    @overload
    def value(self, kind: StringKind) -> str: ...
    @overload
    def value(self, kind: Literal["vector"]) -> Vector2: ...
    @overload
    def value(self, kind: Literal["pose"]) -> Pose: ...
    @overload
    def value(self, kind: Literal["color"]) -> Color: ...

    def value(self, kind: Kind) -> Any:
        """Converts the node itself; kinds and errors are those of `get`."""
        return self._convert(kind)

    @overload
    def get_list(
        self, key: Key, kind: BoolKind, default: D = ..., **options: Unpack[ListSizes]
    ) -> list[bool] | D: ...
    @overload
    def get_list(
        self, key: Key, kind: IntKind, default: D = ..., **options: Unpack[ListLimits]
    ) -> list[int] | D: ...
    @overload
    def get_list(
        self, key: Key, kind: FloatKind, default: D = ..., **options: Unpack[ListLimits]
    ) -> list[float] | D: ...
    @overload
    def get_list(
        self, key: Key, kind: StringKind, default: D = ..., **options: Unpack[ListSizes]
    ) -> list[str] | D: ...
    @overload
    def get_list(
        self, key: Key, kind: Literal["vector"], default: D = ..., **options: Unpack[ListLimits]
    ) -> list[Vector2] | D: ...

    def get_list(
        self,
        key: Key,
        kind: Kind,
        default: object = REQUIRED,
        *,
        min_size: int = 0,
        max_size: int | None = None,
        size: int | None = None,
        **limits: Unpack[Limits],
    ) -> Any:
        """Reads an entry as a list of values of one kind.

        Args:
            key: Key of a map or index of a list.
            kind: Kind of each item, as for `get`.
            default: Returned unchecked if the entry is missing or empty; if omitted, the entry is
                required.
            min_size: Smallest number of items.
            max_size: Largest number of items, None for no limit.
            size: Exact number of items, None for any.
            **limits: Requirements of each number in the list, as for `get`.

        Raises:
            YamlError: The entry is missing, not a list, of another size, or contains an item of
                another kind or out of range.
        """
        if default is not REQUIRED and self._is_missing(key):
            return default
        entry = self.subnode(key, "list")
        entry._check_size(min_size, max_size, size)
        return entry._checked([item._convert(kind) for item in entry.items()], limits)

    def _checked(self, value: T, limits: Limits) -> T:
        why = unmet_limit(value, **limits) if limits else ""
        if why:
            got = list(value) if isinstance(value, tuple) else value
            raise self._invalid(f"{why}, got {got}")
        return value

    def _convert(self, kind: Kind) -> Any:
        if kind in TUPLE_SIZES:
            self._check_kind("list")
            self._check_size(0, None, TUPLE_SIZES[kind])
            return tuple(item._convert("float") for item in self.items())
        if kind not in CONVERSIONS:
            known = sorted(k for k in (*CONVERSIONS, *TUPLE_SIZES) if isinstance(k, str))
            raise ValueError(f"kind must be one of {known}, got {kind!r}")
        type_name, convert = CONVERSIONS[kind]
        try:
            return convert(self._node)
        except ValueError:
            pass
        text = self._node.text if isinstance(self._node, ScalarNode) else ""
        hint = hints.conversion(text, type_name)
        raise self._error(f"Error converting entry {self._label()}to {type_name}", hint=hint)
