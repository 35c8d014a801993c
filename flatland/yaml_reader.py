"""Typed reading of YAML with errors that name the place."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterator
from typing import Any, Literal, TypedDict, TypeVar, Union, Unpack, overload

from flatland.errors import YamlError
from flatland.yaml_convert import SCALARS, TUPLE_SIZES, to_plain, to_vector
from flatland.yaml_node import ListNode, MapNode, Node, NullNode, ScalarNode
from flatland.yaml_preprocessor import Params, preprocess_file, preprocess_text


class _Required:
    """Type of the default that stands for none."""

    def __repr__(self) -> str:
        return "REQUIRED"


REQUIRED = _Required()

D = TypeVar("D")
Key = Union[str, int]  # noqa: UP007
BoolKind = Literal["bool"] | type[bool]
IntKind = Literal["int"] | type[int]
FloatKind = Literal["float"] | type[float]
StringKind = Literal["string"] | type[str]
Kind = BoolKind | IntKind | FloatKind | StringKind | Literal["vector", "pose", "color"]
NodeKind = Literal["any", "map", "list"]
Vector = tuple[float, float]
Pose = tuple[float, float, float]
Color = tuple[float, float, float, float]


class Sizes(TypedDict, total=False):
    """How many items a list may have."""

    min_size: int
    max_size: int | None
    size: int | None


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
        node = self._as_map()
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
    def get(self, key: Key, kind: Literal["vector"], default: D = ...) -> Vector | D: ...
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
        child = self._child(key, default)
        return default if child is None else child._convert(kind)

    @overload
    def value(self, kind: BoolKind) -> bool: ...
    @overload
    def value(self, kind: IntKind) -> int: ...
    @overload
    def value(self, kind: FloatKind) -> float: ...
    @overload
    def value(self, kind: StringKind) -> str: ...
    @overload
    def value(self, kind: Literal["vector"]) -> Vector: ...
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
    ) -> list[Vector] | D: ...

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
        if self._child(key, default) is None:
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
        child = self._child(key, REQUIRED)
        assert child is not None  # noqa: S101 (tells mypy; a missing one has raised)
        child._check_kind(kind, self._quote(key), self._inner_location())
        return child

    def optional_subnode(self, key: Key, kind: NodeKind = "any") -> YamlReader:
        """Opens an entry; one that is missing or empty gives a reader whose `is_null` is true.

        Raises:
            YamlError: It is of another kind.
        """
        child = self._child(key, None)
        if child is None:
            null = NullNode(self._node.source, self._node.line)
            return YamlReader(null, self._inner_location(), self._quote(key))
        child._check_kind(kind, self._quote(key), self._inner_location())
        return child

    def items(self) -> Iterator[YamlReader]:
        """Iterates the items of a list; an empty node has none.

        Raises:
            YamlError: The node is neither.
        """
        if isinstance(self._node, NullNode):
            return
        self._check_kind("list", self.name, self.location)
        for index in range(len(self)):
            yield self.subnode(index)

    def plain(self) -> Any:
        """Returns the node as dict, list, str or None, for whoever keeps it unread."""
        return to_plain(self._node)

    def keys(self) -> list[str]:
        """Returns the keys of a map in the order of the file, none for an empty node.

        Raises:
            YamlError: The node is neither.
        """
        return [] if self.is_null else list(self._as_map().entries)

    def __contains__(self, key: object) -> bool:
        """Tells whether a map has a key."""
        return isinstance(self._node, MapNode) and key in self._node.entries

    def __len__(self) -> int:
        """Returns the number of items of a list or entries of a map, otherwise 0."""
        if isinstance(self._node, ListNode):
            return len(self._node.items)
        return len(self._node.entries) if isinstance(self._node, MapNode) else 0

    def ensure_accessed_all(self) -> None:
        """Checks that every key of the map was read.

        Raises:
            YamlError: Some were not; they are unknown.
        """
        if not isinstance(self._node, MapNode):
            return
        unknown = [key for key in self._node.entries if key not in self._accessed]
        if unknown:
            names = ", ".join(f'"{key}"' for key in sorted(unknown))
            raise self._error(
                f"Entry {self._label()}contains unrecognized entry(s) {{{names}}}",
                self.location,
                self._node.source.place(self._node.key_lines[unknown[0]]),
            )

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

    def _place(self) -> str:
        return self._node.source.place(self._node.line)

    def _label(self) -> str:
        return f"{self.name.lower()} " if self.name else ""

    def _inner_location(self) -> str:
        return f"{self.location} {self.name}".strip()

    @staticmethod
    def _quote(key: Key) -> str:
        return f"index={key}" if isinstance(key, int) else f'"{key}"'

    def _error(self, message: str, location: str, place: str) -> YamlError:
        where = f" (in {location.lower()})" if location else ""
        return YamlError(f"{message}{where}{place}")

    def _as_map(self) -> MapNode:
        self._check_kind("map", self.name, self.location)
        assert isinstance(self._node, MapNode)  # noqa: S101
        return self._node

    def _check_kind(self, kind: NodeKind, name: str, location: str) -> None:
        fits = {"any": True, "map": self.is_map, "list": self.is_list}[kind]
        if not fits:
            label = f"{name} " if name else ""
            raise self._error(f"Entry {label}must be a {kind}", location, self._place())

    def _child(self, key: Key, default: object) -> YamlReader | None:
        """Opens an entry, None for one that is missing or empty if there is a default."""
        node: Node | None = None
        if isinstance(key, int):
            if not self.is_null:
                self._check_kind("list", self.name, self.location)
            if isinstance(self._node, ListNode) and 0 <= key < len(self._node.items):
                node = self._node.items[key]
        else:
            if not self.is_null:
                self._check_kind("map", self.name, self.location)
            if isinstance(self._node, MapNode):
                self._accessed.add(key)
                node = self._node.entries.get(key)
        if default is not REQUIRED and (node is None or isinstance(node, NullNode)):
            return None
        if node is None:
            raise self._error(
                f"Entry {self._quote(key)} does not exist", self._inner_location(), self._place()
            )
        return YamlReader(node, self._inner_location(), self._quote(key))

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
        raise self._error(
            f"Entry {self._label()}must have size {wanted}", self.location, self._place()
        )

    def _convert(self, kind: Kind) -> Any:
        if kind in TUPLE_SIZES:
            self._check_kind("list", self.name, self.location)
            self._check_size(0, None, TUPLE_SIZES[kind])
            return tuple(item._convert("float") for item in self.items())
        type_name, convert = SCALARS.get(kind, ("vector", None))
        try:
            if convert is None:
                return to_vector(self._node)
            if isinstance(self._node, ScalarNode):
                return convert(self._node.text)
        except ValueError:
            pass
        raise self._error(
            f"Error converting entry {self._label()}to {type_name}", self.location, self._place()
        )
