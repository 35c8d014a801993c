"""Reading of YAML trees, with errors that name the file, the line and the entry."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any, Literal, Self, TypeVar, Unpack, overload

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
    NodeKind,
    StringKind,
    to_plain,
    unmet_limit,
)
from flatland.config.file_kinds import REQUIRED_KEYS, FileKind, kind_of, mistaken_file
from flatland.config.inputs import Inputs, Params
from flatland.config.node import ListNode, MapNode, Node, NullNode, ScalarNode
from flatland.config.preprocessor import preprocess_file, preprocess_text
from flatland.errors import FlatlandError, Place, YamlError
from flatland.geometry import Pose, Vector2

D = TypeVar("D")
R = TypeVar("R")
T = TypeVar("T")
REQUIRED = object()
"""Default of an entry that is required."""


ReadYaml = Callable[[str, Inputs], "YamlReader"]
"""Loads and preprocesses a file: `read_yaml`, or `ErrorCollector.read`."""


def read_yaml(path: str, inputs: Inputs) -> YamlReader:
    """Loads and preprocesses a file of a world.

    Args:
        path: The file.
        inputs: Reads the file, the files that it includes, and parameters.

    Raises:
        YamlError: The file cannot be read, is not valid YAML, or cannot be preprocessed.
    """
    return YamlReader(preprocess_file(path, inputs))


class YamlReader:
    """A node of a YAML file with its location, and a record of the keys that were read.

    `ensure_accessed_all` raises an error for keys that have not been read, which are usually
    misspelled. A reader shares its record with the readers returned by `with_location`.

    Attributes:
        location: Description of the parent, such as `model "turtlebot" body "base"`.
        name: Name of the node in its parent, such as `"footprints"` or `index=1`.
    """

    def __init__(self, node: Node, location: str = "", name: str = "") -> None:
        """Wraps a node; readers are usually created by `from_file` and `from_string`."""
        self._node = node
        self._accessed: set[str] = set()
        self.location = location
        self.name = name

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], params: Params = None) -> Self:
        """Loads and preprocesses a file that is not part of a world.

        A plugin reads its files with `FlatlandPlugin.read_yaml`, so that they are part of
        recordings and of resets.

        Args:
            path: The file.
            params: Source of the values of `param(NAME)`: a mapping, or a function that returns
                None for an unknown name.

        Raises:
            YamlError: The file cannot be read, is not valid YAML, or cannot be preprocessed.
        """
        return cls(preprocess_file(os.fspath(path), Inputs(params)))

    @classmethod
    def from_string(
        cls,
        text: str,
        params: Params = None,
        base_dir: str | os.PathLike[str] = ".",
        name: str = "",
    ) -> Self:
        """Parses and preprocesses a text.

        Args:
            text: One YAML document.
            params: As for `from_file`.
            base_dir: Folder that relative paths start from.
            name: Name of the text in error messages, in place of a file.

        Raises:
            YamlError: The text is not valid YAML, or cannot be preprocessed.
        """
        return cls(preprocess_text(text, os.fspath(base_dir), Inputs(params), name))

    def unread(self) -> Self:
        """Returns a reader of the same node that has a record of its own, without any keys."""
        reader = copy.copy(self)
        reader._accessed = set()
        return reader

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.location} {self.name}{self.place.suffix}>"

    @property
    def path(self) -> str:
        """File that contains the node, empty for a node of a text."""
        return self._node.source.path

    @property
    def line(self) -> int:
        """Line of the node in its file, from 1."""
        return self._node.line

    @property
    def place(self) -> Place:
        """Position of the node in its file."""
        return self._node.source.place(self._node.line)

    @property
    def is_null(self) -> bool:
        """Whether the node has no value."""
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

    def with_location(self, location: str, name: str = "") -> Self:
        """Returns a reader of the same node with another location, and the same record of keys."""
        reader = copy.copy(self)
        reader.location = location
        reader.name = name
        return reader

    def without(self, *keys: str) -> Self:
        """Returns a reader of the same map without some keys, with a new record of keys.

        Raises:
            YamlError: The node is not a map.
        """
        node = self._node
        if not isinstance(node, MapNode):
            self._check_kind("map")
            return self
        entries = {key: value for key, value in node.entries.items() if key not in keys}
        rest = MapNode(node.source, node.line, entries, node.key_lines)
        return self._derived(rest, self.location, self.name)

    def updated(self, entries: Mapping[str, YamlReader]) -> Self:
        """Returns a reader of the same map with other entries, with a new record of keys.

        Args:
            entries: Readers of the entries that are replaced or added, by key.

        Raises:
            YamlError: The node is neither a map nor null.
        """
        node = self._node
        if not isinstance(node, MapNode | NullNode):
            self._check_kind("map")
        known = node if isinstance(node, MapNode) else MapNode(node.source, node.line)
        nodes = {key: reader._node for key, reader in entries.items()}
        lines = {key: entry.line for key, entry in nodes.items()}
        merged = MapNode(known.source, known.line, known.entries | nodes, known.key_lines | lines)
        return self._derived(merged, self.location, self.name)

    def subnode(self, key: Key, kind: NodeKind = "any") -> Self:
        """Returns a reader of a required entry.

        Args:
            key: Key of a map or index of a list.
            kind: Required kind of the entry: `any`, `map` or `list`.

        Raises:
            YamlError: The entry is missing, or of another kind.
        """
        entry = self._open(key)
        entry._check_kind(kind)
        return entry

    def optional_subnode(self, key: Key, kind: NodeKind = "any") -> Self:
        """Returns a reader of an entry, whose `is_null` is true if the entry is missing or empty.

        Raises:
            YamlError: The entry is of another kind.
        """
        if self._is_missing(key):
            return self._reader(NullNode(self._node.source, self._node.line), key)
        return self.subnode(key, kind)

    def items(self) -> Iterator[Self]:
        """Iterates over the items of a list; a null node has no items.

        Raises:
            YamlError: The node is neither a list nor null.
        """
        if not self.is_null:
            self._check_kind("list")
        for index in range(len(self)):
            yield self._open(index)

    def plain(self) -> Any:
        """Returns the unconverted content of the node as dict, list, str or None."""
        return to_plain(self._node)

    def keys(self) -> list[str]:
        """Returns the keys of a map in the order of the file; a null node has no keys.

        Raises:
            YamlError: The node is neither a map nor null.
        """
        if not self.is_null:
            self._check_kind("map")
        return list(self._node.entries) if isinstance(self._node, MapNode) else []

    def __contains__(self, key: object) -> bool:
        """Returns whether the node is a map that has a key."""
        return isinstance(self._node, MapNode) and key in self._node.entries

    def __len__(self) -> int:
        """Returns the number of items of a list or entries of a map, otherwise 0."""
        if isinstance(self._node, ListNode):
            return len(self._node.items)
        return len(self._node.entries) if isinstance(self._node, MapNode) else 0

    def unread_keys(self) -> list[str]:
        """Returns the keys of a map that have not been read, in the order of the file."""
        entries = self._node.entries if isinstance(self._node, MapNode) else ()
        return [key for key in entries if key not in self._accessed]

    def ensure_accessed_all(self) -> None:
        """Checks that every key of the map has been read.

        Raises:
            YamlError: The map has other keys, which are unknown.
        """
        unread = self.unread_keys()
        if unread and isinstance(self._node, MapNode):
            names = ", ".join(f'"{key}"' for key in sorted(unread))
            message = f"Entry {self._label()}contains unrecognized entry(s) {{{names}}}"
            known = self._accessed - set(self._node.entries)
            hint = hints.unknown_key(unread[0], known, self.name)
            raise self._error(message, self._node.key_lines[unread[0]], hint)

    def error(self, message: str, hint: str = "") -> YamlError:
        """Returns an error whose text ends with the position of the node: `[model.yaml:12]`.

        Args:
            message: Description of the problem.
            hint: What probably helps; not part of the text.
        """
        return YamlError(message + self.place.suffix, place=self.place, hint=hint)

    def invalid(self, key: Key, why: str) -> YamlError:
        """Returns an error about the value of an entry: `Invalid "KEY", WHY (in LOCATION)`.

        Args:
            key: Key of a map or index of a list; the entry may be missing.
            why: Violated requirement and value found, such as `must be positive, got -1`.
        """
        node = self._find(key)
        return self._reader(self._node if node is None else node, key)._invalid(why)

    @property
    def file_kind(self) -> FileKind | None:
        """Kind of the file of which this is the root, None if it cannot be recognized."""
        return kind_of(self._node)

    def require_kind(self, kind: FileKind) -> None:
        """Checks that the file, of which this is the root, is not one of another kind.

        A file of unknown kind is accepted; its missing keys are errors when they are read.

        Args:
            kind: `world`, `model` or `map`.

        Raises:
            YamlError: The file is of another kind; also raised if errors are collected, since each
                key would be an error.
        """
        if self.file_kind not in (None, kind):
            root = YamlReader(self._node, self.location, self.name)
            root.subnode(REQUIRED_KEYS[kind][0])

    @property
    def is_complete(self) -> bool:
        """Whether no required entry that was read from the node is missing or invalid.

        Always true unless errors are collected, since such an entry raises an error.
        """
        return True

    def resolve_path(self, path: str) -> str:
        """Returns an absolute path.

        Args:
            path: An absolute path, one that starts with `~`, or one relative to the folder of the
                file that contains the node.
        """
        return self._node.source.resolve(path)

    # -- typed values ----------------------------------------------------------------------

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
            kind: `string`, `float`, `int`, `bool` (or the Python type); `angle` for a float in
                radians; `vector` for (x, y), `pose` for (x, y, theta), `color` for (r, g, b, a),
                all of floats. `flatland check` warns about angles that are probably in degrees.
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
        return entry._checked(entry._convert(kind), limits, kind)

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
        """Converts the node itself, with the same kinds and errors as `get`."""
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
        return entry._checked([item._convert(kind) for item in entry.items()], limits, kind)

    # -- collection of errors, see `flatland.config.collecting_reader` -------------------------

    def warn(self, key: Key, what: str | Callable[[], str], hint: str = "") -> None:
        """Does nothing; a reader that collects errors logs a warning about a valid value.

        Args:
            key: Key of the entry.
            what: The value, and why it is suspicious; or a function that returns this, or an empty
                string for no warning.
            hint: What probably helps.
        """

    def report(self, error: FlatlandError) -> None:
        """Raises an error; a reader that collects errors stores the error and returns."""
        raise error

    def collect_errors(self) -> AbstractContextManager[None]:
        """Returns a context that has no effect.

        With a reader that collects errors, an error ends only the block.
        """
        return nullcontext()

    def collect_errors_of_model(self, name: str) -> AbstractContextManager[None]:  # noqa: ARG002
        """Returns a context that has no effect; see `CollectingReader`."""
        return nullcontext()

    def attempt(self, action: Callable[[Self], R]) -> R | None:
        """Returns the result of an action that reads this node, such as a hook of a plugin.

        With a reader that collects errors, the action is repeated after an error, with values in
        place of the invalid ones, and the result may be None.
        """
        return action(self)

    def _label(self) -> str:
        return f"{self.name.lower()} " if self.name else ""

    def _error(self, message: str, line: int | None = None, hint: str = "") -> YamlError:
        where = f" (in {self.location.lower()})" if self.location else ""
        place = self._node.source.place(line or self._node.line)
        return YamlError(message + where + place.suffix, place=place, hint=hint)

    def _invalid(self, why: str, hint: str = "") -> YamlError:
        return self._error(f"Invalid {self.name}, {why}", hint=hint)

    def _check_kind(self, kind: NodeKind) -> None:
        if not {"any": True, "map": self.is_map, "list": self.is_list}[kind]:
            name = f"{self.name} " if self.name else ""
            if kind == "list":
                text = self._node.text if isinstance(self._node, ScalarNode) else None
                hint = "" if self.is_null else hints.not_a_list(self.name, self.location, text)
            else:
                hint = hints.not_a_map(self.location) if name else mistaken_file(self._node)
            raise self._error(f"Entry {name}must be a {kind}", hint=hint)

    def _find_quietly(self, key: Key) -> Node | None:
        """Returns the node of an entry, None if this node has no such entry."""
        if isinstance(self._node, MapNode) and isinstance(key, str):
            return self._node.entries.get(key)
        if isinstance(self._node, ListNode) and isinstance(key, int):
            return self._node.items[key] if 0 <= key < len(self._node.items) else None
        return None

    def _find(self, key: Key) -> Node | None:
        """Returns the node of an entry or None, and records that the key was read."""
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

    def _open(self, key: Key) -> Self:
        node = self._find(key)
        if node is None:
            missing = self._reader(self._node, key)
            hint = "" if self.name else mistaken_file(self._node, str(key))
            if not hint and isinstance(key, str) and isinstance(self._node, MapNode):
                lines = self._node.key_lines
                hint = hints.missing_key(key, {name: lines[name] for name in self.unread_keys()})
            raise missing._error(f"Entry {missing.name} does not exist", hint=hint)
        return self._reader(node, key)

    def _reader(self, node: Node, key: Key) -> Self:
        name = f'"{key}"' if isinstance(key, str) else f"index={key}"
        return self._derived(node, f"{self.location} {self.name}".strip(), name)

    def _derived(self, node: Node, location: str, name: str) -> Self:
        """Creates a reader of another node, with a new record of keys."""
        return type(self)(node, location, name)

    def _check_size(self, min_size: int, max_size: int | None, size: int | None) -> None:
        count = len(self)
        if min_size == max_size:
            size = min_size
        if size is not None and count != size:
            required = f"of exactly {size}"
        elif count < min_size:
            required = f">= {min_size}"
        elif max_size is not None and count > max_size:
            required = f"<= {max_size}"
        else:
            return
        hint = hints.wrong_size(self.name)
        raise self._error(f"Entry {self._label()}must have size {required}", hint=hint)

    def _checked(self, value: T, limits: Limits, kind: Kind) -> T:
        why = unmet_limit(value, **limits) if limits else ""
        if why:
            got = list(value) if isinstance(value, tuple) else value
            hint = hints.unmet_limit(value, kind, f"{self.location} {self.name}")
            raise self._invalid(f"{why}, got {got}", hint)
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
        hint = hints.conversion(text, type_name, self.location)
        raise self._error(f"Error converting entry {self._label()}to {type_name}", hint=hint)
