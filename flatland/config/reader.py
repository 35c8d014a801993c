"""Typed reading of YAML with errors that name the place."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterator
from typing import Any, Literal, TypeVar, Unpack, overload

from flatland.config.convert import (
    CONVERSIONS,
    TUPLE_SIZES,
    BoolKind,
    Color,
    FloatKind,
    IntKind,
    Key,
    Kind,
    NodeKind,
    Sizes,
    StringKind,
    to_plain,
)
from flatland.config.node import ListNode, MapNode, Node, NullNode, ScalarNode
from flatland.config.preprocessor import Params, preprocess_file, preprocess_text
from flatland.errors import YamlError
from flatland.geometry import Pose, Vector2

D = TypeVar("D")
REQUIRED = object()
"""The default that stands for none."""


class YamlReader:
    """A node of a YAML file, the place where it stands and the keys that were read of it.

    A reader and those that `with_location` makes of it share the record of the keys; what
    nobody has read by the time of `ensure_accessed_all` is a typing mistake of the user.

    Attributes:
        location: What the node is in, such as `model "turtlebot" body "base"`.
        name: What it is there, such as `"footprints"` or `index=1`.
    """

    def __init__(self, node: Node, location: str = "", name: str = "") -> None:
        """Wraps a node; `from_file` and `from_string` are the usual ways to a reader."""
        self._node = node
        self._accessed: set[str] = set()
        self.location = location
        self.name = name

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], params: Params = None) -> YamlReader:
        """Loads and preprocesses a file.

        Args:
            path: The file.
            params: What `param(NAME)` answers: values by name, or a function of the name that
                returns None for one that is not set.

        Raises:
            YamlError: The file cannot be read, is not YAML, or its preprocessing fails.
        """
        return cls(preprocess_file(os.fspath(path), params))

    @classmethod
    def from_string(
        cls, text: str, params: Params = None, base_dir: str | os.PathLike[str] = "."
    ) -> YamlReader:
        """Parses and preprocesses a text.

        Args:
            text: One YAML document.
            params: As for `from_file`.
            base_dir: Folder that relative paths start from.

        Raises:
            YamlError: The text is not YAML, or its preprocessing fails.
        """
        return cls(preprocess_text(text, os.fspath(base_dir), params))

    def __repr__(self) -> str:
        return f"<YamlReader {self.location} {self.name}{self._place()}>"

    @property
    def path(self) -> str:
        """The file that the node stands in, empty for a string."""
        return self._node.source.path

    @property
    def line(self) -> int:
        """The line of the node in its file, from 1."""
        return self._node.line

    @property
    def is_null(self) -> bool:
        """Whether there is no value."""
        return isinstance(self._node, NullNode)

    @property
    def is_map(self) -> bool:
        """Whether the node is a map."""
        return isinstance(self._node, MapNode)

    @property
    def is_list(self) -> bool:
        """Whether the node is a list."""
        return isinstance(self._node, ListNode)

    @property
    def is_scalar(self) -> bool:
        """Whether the node is a single value."""
        return isinstance(self._node, ScalarNode)

    def with_location(self, location: str, name: str = "") -> YamlReader:
        """Returns the same node with an explicit place, and the same record of read keys."""
        reader = copy.copy(self)
        reader.location = location
        reader.name = name
        return reader

    def without(self, *keys: str) -> YamlReader:
        """Returns the same map without some keys, with a record of its own.

        Raises:
            YamlError: The node is not a map.
        """
        node = self._node
        if not isinstance(node, MapNode):
            self._check_kind("map")
            return self
        entries = {key: value for key, value in node.entries.items() if key not in keys}
        rest = MapNode(node.source, node.line, entries, node.key_lines)
        return YamlReader(rest, self.location, self.name)

    # What each kind converts to, for the type checker; `default` is returned as it is.
    @overload
    def get(self, key: Key, kind: BoolKind, default: D = ...) -> bool | D: ...
    @overload
    def get(self, key: Key, kind: IntKind, default: D = ...) -> int | D: ...
    @overload
    def get(self, key: Key, kind: FloatKind, default: D = ...) -> float | D: ...
    @overload
    def get(self, key: Key, kind: StringKind, default: D = ...) -> str | D: ...
    @overload
    def get(self, key: Key, kind: Literal["vector"], default: D = ...) -> Vector2 | D: ...
    @overload
    def get(self, key: Key, kind: Literal["pose"], default: D = ...) -> Pose | D: ...
    @overload
    def get(self, key: Key, kind: Literal["color"], default: D = ...) -> Color | D: ...

    def get(self, key: Key, kind: Kind, default: object = REQUIRED) -> Any:
        """Reads an entry as one kind of value.

        Args:
            key: Key of a map or index of a list.
            kind: `string`, `float`, `int`, `bool` (or the Python type); `vector` for (x, y),
                `pose` for (x, y, theta), `color` for (r, g, b, a), all of floats.
            default: Returned when the entry is missing or empty; without it that is an error.

        Raises:
            YamlError: The entry is missing or is of another kind.
        """
        if default is not REQUIRED and self._is_missing(key):
            return default
        return self._open(key)._convert(kind)

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
        """Converts the node itself; kinds and errors as for `get`."""
        return self._convert(kind)

    @overload
    def get_list(
        self, key: Key, kind: BoolKind, default: D = ..., **sizes: Unpack[Sizes]
    ) -> list[bool] | D: ...
    @overload
    def get_list(
        self, key: Key, kind: IntKind, default: D = ..., **sizes: Unpack[Sizes]
    ) -> list[int] | D: ...
    @overload
    def get_list(
        self, key: Key, kind: FloatKind, default: D = ..., **sizes: Unpack[Sizes]
    ) -> list[float] | D: ...
    @overload
    def get_list(
        self, key: Key, kind: StringKind, default: D = ..., **sizes: Unpack[Sizes]
    ) -> list[str] | D: ...
    @overload
    def get_list(
        self, key: Key, kind: Literal["vector"], default: D = ..., **sizes: Unpack[Sizes]
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
    ) -> Any:
        """Reads an entry as a list of values of one kind.

        Args:
            key: Key of a map or index of a list.
            kind: Of each item, as for `get`.
            default: Returned when the entry is missing or empty; without it that is an error.
            min_size: Least number of items.
            max_size: Greatest number of items, None for any.
            size: Exact number of items, None for any.

        Raises:
            YamlError: The entry is missing, not a list, of another size or with other items.
        """
        if default is not REQUIRED and self._is_missing(key):
            return default
        entry = self.subnode(key, "list")
        entry._check_size(min_size, max_size, size)
        return [item._convert(kind) for item in entry.items()]

    def subnode(self, key: Key, kind: NodeKind = "any") -> YamlReader:
        """Opens an entry that must be there.

        Args:
            key: Key of a map or index of a list.
            kind: What it must be: `any`, `map` or `list`.

        Raises:
            YamlError: There is none, or it is of another kind.
        """
        entry = self._open(key)
        entry._check_kind(kind)
        return entry

    def optional_subnode(self, key: Key, kind: NodeKind = "any") -> YamlReader:
        """Opens an entry; one that is missing or empty gives a reader whose `is_null` is true.

        Raises:
            YamlError: It is of another kind.
        """
        if self._is_missing(key):
            return self._reader(NullNode(self._node.source, self._node.line), key)
        return self.subnode(key, kind)

    def items(self) -> Iterator[YamlReader]:
        """Iterates the items of a list; an empty node has none.

        Raises:
            YamlError: The node is neither.
        """
        if not self.is_null:
            self._check_kind("list")
        for index in range(len(self)):
            yield self._open(index)

    def plain(self) -> Any:
        """Returns the node as dict, list, str or None, for whoever keeps it unread."""
        return to_plain(self._node)

    def keys(self) -> list[str]:
        """Returns the keys of a map in the order of the file, none for an empty node.

        Raises:
            YamlError: The node is neither.
        """
        if not self.is_null:
            self._check_kind("map")
        return list(self._node.entries) if isinstance(self._node, MapNode) else []

    def __contains__(self, key: object) -> bool:
        """Tells whether a map has a key."""
        return isinstance(self._node, MapNode) and key in self._node.entries

    def __len__(self) -> int:
        """Returns the number of items of a list or entries of a map, otherwise 0."""
        if isinstance(self._node, ListNode):
            return len(self._node.items)
        return len(self._node.entries) if isinstance(self._node, MapNode) else 0

    def unread_keys(self) -> list[str]:
        """Returns the keys of a map that were not read yet, in the order of the file."""
        entries = self._node.entries if isinstance(self._node, MapNode) else ()
        return [key for key in entries if key not in self._accessed]

    def ensure_accessed_all(self) -> None:
        """Checks that every key of the map was read.

        Raises:
            YamlError: Some were not; they are unknown.
        """
        unread = self.unread_keys()
        if unread and isinstance(self._node, MapNode):
            names = ", ".join(f'"{key}"' for key in sorted(unread))
            message = f"Entry {self._label()}contains unrecognized entry(s) {{{names}}}"
            raise self._error(message, self._node.key_lines[unread[0]])

    def error(self, message: str) -> YamlError:
        """Makes an error with the node's place, such as ` [model.yaml:12]`, behind the text."""
        return YamlError(message + self._place())

    def resolve_path(self, path: str) -> str:
        """Makes a path absolute.

        Args:
            path: An absolute one, one that starts with `~`, or one relative to the folder of
                the file that the node stands in.
        """
        return self._node.source.resolve(path)

    def _place(self, line: int | None = None) -> str:
        return self._node.source.place(line or self._node.line)

    def _label(self) -> str:
        return f"{self.name.lower()} " if self.name else ""

    def _error(self, message: str, line: int | None = None) -> YamlError:
        where = f" (in {self.location.lower()})" if self.location else ""
        return YamlError(message + where + self._place(line))

    def _check_kind(self, kind: NodeKind) -> None:
        if not {"any": True, "map": self.is_map, "list": self.is_list}[kind]:
            name = f"{self.name} " if self.name else ""
            raise self._error(f"Entry {name}must be a {kind}")

    def _find(self, key: Key) -> Node | None:
        """Returns an entry's node and records that its key was read."""
        if isinstance(key, str):
            if isinstance(self._node, MapNode):
                self._accessed.add(key)
                return self._node.entries.get(key)
        elif isinstance(self._node, ListNode):
            return self._node.items[key] if 0 <= key < len(self._node.items) else None
        if not self.is_null:
            self._check_kind("map" if isinstance(key, str) else "list")
        return None

    def _is_missing(self, key: Key) -> bool:
        node = self._find(key)
        return node is None or isinstance(node, NullNode)

    def _open(self, key: Key) -> YamlReader:
        node = self._find(key)
        if node is None:
            missing = self._reader(self._node, key)
            raise missing._error(f"Entry {missing.name} does not exist")
        return self._reader(node, key)

    def _reader(self, node: Node, key: Key) -> YamlReader:
        name = f'"{key}"' if isinstance(key, str) else f"index={key}"
        return YamlReader(node, f"{self.location} {self.name}".strip(), name)

    def _check_size(self, min_size: int, max_size: int | None, size: int | None) -> None:
        count = len(self)
        if min_size == max_size:
            size = min_size
        if size is not None and count != size:
            wanted = f"of exactly {size}"
        elif count < min_size:
            wanted = f">= {min_size}"
        elif max_size is not None and count > max_size:
            wanted = f"<= {max_size}"
        else:
            return
        raise self._error(f"Entry {self._label()}must have size {wanted}")

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
        raise self._error(f"Error converting entry {self._label()}to {type_name}")
