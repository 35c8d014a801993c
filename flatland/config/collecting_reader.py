"""A reader that collects the errors of files instead of raising the first one."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any, Self, TypeVar, Unpack

from flatland.config import hints
from flatland.config.convert import TUPLE_SIZES, Key, Kind, Limits, NodeKind
from flatland.config.inputs import Inputs
from flatland.config.node import ListNode, MapNode, Node, NullNode
from flatland.config.preprocessor import preprocess_file
from flatland.config.reader import REQUIRED, YamlReader
from flatland.errors import FlatlandError, Place, YamlError

R = TypeVar("R")

_LOG = logging.getLogger("flatland")

_ITEM_KEYS = {"name", "type"}  # of most maps that are items of a list


class FollowUpError(YamlError):
    """An error that results from another one, which has been collected."""


class ErrorCollector:
    """The errors of some files in the order in which they were found, without duplicates.

    Attributes:
        errors: The errors.
        found: Number of errors with duplicates.
        place: Position of the entry that is being loaded, None at the end.
    """

    def __init__(self) -> None:
        """Creates an empty list."""
        self.errors: list[FlatlandError] = []
        self.found = 0
        self.place: Place | None = None
        self._found_before = 0
        self._seen: set[tuple[Place | None, str]] = set()
        self._model = ""
        self._stand_ins: list[str] = []
        # By id; the nodes are kept because the id of a deleted object can be reused.
        self._unusable: dict[int, Node] = {}
        self._bad_spots: set[_Spot] = set()

    def read(self, path: str, inputs: Inputs) -> CollectingReader:
        """Loads a file; its reader and all readers of its entries collect errors.

        Raises:
            YamlError: The file cannot be read or is not valid YAML.
        """
        return CollectingReader(preprocess_file(path, inputs, self._keep)).into(self)

    def add(self, error: FlatlandError) -> None:
        """Adds an error, unless the error is a follow-up or was added for another model."""
        if isinstance(error, FollowUpError) or isinstance(error.__cause__, FollowUpError):
            return
        self.found += 1
        for part in error.parts():
            for stand_in in self._stand_ins:
                part.message = part.message.replace(stand_in, "?")
            text = part.message
            if self._model:  # models of one file have the same errors
                text = text.replace(f'"{self._model}"', '""')
                text = text.replace(f'"{self._model.lower()}"', '""')
            if (part.place, text) not in self._seen:
                self._seen.add((part.place, text))
                self.errors.append(part)

    @contextmanager
    def at(self, place: Place | None) -> Iterator[None]:
        """Sets `place` for a block, which an error ends; the error is added."""
        outer, self.place = self.place, place
        found_before, self._found_before = self._found_before, self.found
        try:
            yield
        except FlatlandError as error:
            self.add(error)
        finally:
            self.place = outer
            self._found_before = found_before

    @property
    def has_error_here(self) -> bool:
        """Whether the entry that is being loaded has an error."""
        return self.found > self._found_before

    @contextmanager
    def model(self, name: str) -> Iterator[None]:
        """Sets the name of the model that is loaded in a block."""
        outer, self._model = self._model, name
        try:
            yield
        finally:
            self._model = outer

    def is_unusable(self, node: Node | None) -> bool:
        """Returns whether a node is a `$eval` or `$include` that failed, or was marked."""
        return id(node) in self._unusable

    def is_bad(self, spot: _Spot) -> bool:
        """Returns whether there is an error about the value of a spot."""
        return spot in self._bad_spots

    def mark(self, error: _ValueError) -> bool:
        """Makes readers return the default or a stand-in in place of the value of an error.

        Returns:
            Whether readers returned the value itself before.
        """
        is_new = not self.is_unusable(error.node) or (
            error.spot is not None and error.spot not in self._bad_spots
        )
        if error.node is not None:
            self._unusable[id(error.node)] = error.node
        if error.spot is not None:
            self._bad_spots.add(error.spot)
        return is_new and (error.node is not None or error.spot is not None)

    def new_name(self) -> str:
        """Returns a name in place of a missing one; a question mark in the texts of errors."""
        self._stand_ins.append(f"(unknown {len(self._stand_ins) + 1})")
        return self._stand_ins[-1]

    def _keep(self, error: YamlError, node: Node) -> None:
        self.add(error)
        self._unusable[id(node)] = node


def _g(number: float) -> str:
    return f"{number:g}"


_Spot = tuple[Place, str, str, Key]
"""Place, location and name of a reader, and a key."""


class _ValueError(YamlError):
    """An error about a value.

    Attributes:
        node: The value, None if it is missing.
        spot: Where it was read, None if the caller created the error.
    """

    node: Node | None = None
    spot: _Spot | None = None


def _about(error: YamlError, node: Node | None, spot: _Spot | None = None) -> _ValueError:
    result = _ValueError(error.message, place=error.place, hint=error.hint)
    result.node, result.spot = node, spot
    return result


class CollectingReader(YamlReader):
    """A reader that adds errors to an `ErrorCollector` and continues.

    In place of an invalid value it returns the default, or a stand-in if the value is required.
    Errors that the caller creates about stand-ins are follow-up errors and not collected.
    """

    _collector: ErrorCollector
    _is_stand_in: bool
    _raises: bool = False
    _bad_keys: set[Key]  # shared like the record of the keys that were read

    def into(
        self, collector: ErrorCollector, bad_keys: set[Key] | None = None, stand_in: bool = False
    ) -> Self:
        """Sets the collector and returns the reader.

        Args:
            collector: Receives the errors.
            bad_keys: Keys whose required values are missing or invalid.
            stand_in: Whether the node stands in for an invalid one.
        """
        self._collector = collector
        self._bad_keys = set() if bad_keys is None else bad_keys
        self._is_stand_in = stand_in
        return self

    # -- reading ---------------------------------------------------------------------------

    def get(
        self, key: Key, kind: Kind, default: object = REQUIRED, **limits: Unpack[Limits]
    ) -> Any:
        """Reads an entry; see `YamlReader.get`."""

        def read(reader: Any) -> Any:
            value = reader.get(key, kind, default, **limits)
            self._warn_about_degrees(key, kind, value)
            return value

        return self._read(key, kind, default, limits, read)

    def get_list(self, key: Key, kind: Kind, default: object = REQUIRED, **options: Any) -> Any:
        """Reads an entry as a list; see `YamlReader.get_list`."""

        def read(reader: Any) -> Any:
            values = reader.get_list(key, kind, default, **options)
            self._warn_about_degrees(key, kind, values)
            return values

        size = options.get("size") or options.get("min_size", 0)
        limits = {key: options[key] for key in ("minimum", "maximum") if key in options}
        return self._read(key, kind, default, limits, read, size)

    def _read(
        self,
        key: Key,
        kind: Kind,
        default: object,
        limits: Any,
        read: Callable[[YamlReader], Any],
        size: int | None = None,
    ) -> Any:
        if not self._is_invalid(key):
            try:
                return read(self._strict())
            except YamlError as error:
                self._handle(error, key)
        if default is not REQUIRED:
            return default
        self._bad_keys.add(key)
        if size is None:
            return self._stand_in(kind, limits)
        return [self._stand_in(kind, limits) for _ in range(size)]

    def _warn_about_degrees(self, key: Key, kind: Kind, value: Any) -> None:
        """Logs a warning if an angle of a value is probably in degrees."""
        hint = hints.degrees_of(value, kind)
        if hint and self._find_quietly(key) is not None:
            shown = f"{value:g}" if isinstance(value, float) else f"[{', '.join(map(_g, value))}]"
            self.warn(key, f"{shown}, with an angle of more than a full turn", hint)

    def _is_invalid(self, key: Key) -> bool:
        """Returns whether errors about an entry are known or follow from others."""
        if isinstance(key, str):
            self._accessed.add(key)
        collector = self._collector
        return (
            self._is_stand_in
            or collector.is_unusable(self._subject(key))
            or collector.is_bad(self._spot(key))
        )

    def _subject(self, key: Key) -> Node | None:
        """Returns the node of an entry; this node, if it can have no entries; otherwise None."""
        node = self._node
        entry = self._find_quietly(key)
        has_entries = isinstance(node, NullNode | (MapNode if isinstance(key, str) else ListNode))
        return entry if entry is not None or has_entries else node

    def _spot(self, key: Key) -> _Spot:
        return (self.place, self.location, self.name, key)

    def _handle(self, error: YamlError, key: Key) -> None:
        located = _about(error, self._subject(key), self._spot(key))
        if self._raises:
            raise located
        self._collector.add(located)
        self._collector.mark(located)

    def _stand_in(self, kind: Kind, limits: Limits) -> Any:
        if kind in ("string", str):
            return self._collector.new_name()
        if kind in ("bool", bool):
            return False
        number = 1.0
        minimum, maximum = limits.get("minimum"), limits.get("maximum")
        if minimum is not None:
            number = max(number, minimum)
        if maximum is not None:
            number = min(number, maximum)
        if kind in ("int", int):
            return int(number)
        if kind in ("float", float, "angle"):
            return number
        return (number,) * TUPLE_SIZES.get(str(kind), 2)

    def subnode(self, key: Key, kind: NodeKind = "any") -> Self:
        """Returns a reader of a required entry; see `YamlReader.subnode`."""
        return self._sub(key, kind, lambda reader: reader.subnode(key, kind))

    def optional_subnode(self, key: Key, kind: NodeKind = "any") -> Self:
        """Returns a reader of an optional entry; see `YamlReader.optional_subnode`."""
        return self._sub(key, kind, lambda reader: reader.optional_subnode(key, kind))

    def _sub(self, key: Key, kind: NodeKind, open_: Callable[[YamlReader], YamlReader]) -> Self:
        if not (self._is_invalid(key) or key in self._bad_keys):
            try:
                entry = open_(self._strict())
                return self._derived(entry._node, entry.location, entry.name)
            except YamlError as error:
                self._handle(error, key)
        self._bad_keys.add(key)
        item = self._find_quietly(key)
        if kind == "list" and isinstance(item, MapNode) and item.entries.keys() & _ITEM_KEYS:
            # The dash of the only item is missing; other entries may refer to this item.
            return self._reader(ListNode(item.source, item.line, [item]), key)
        source, line = self._node.source, self._node.line
        nodes: dict[NodeKind, Node] = {
            "list": ListNode(source, line),
            "map": MapNode(source, line),
            "any": NullNode(source, line),
        }
        return self._reader(nodes[kind], key).into(self._collector, stand_in=True)

    @property
    def is_complete(self) -> bool:
        """Whether no required entry that was read is missing or invalid."""
        return not (self._is_stand_in or self._bad_keys)

    def ensure_accessed_all(self) -> None:
        """Adds an error for each key of the map that has not been read."""
        node = self._node
        if self._is_stand_in or not isinstance(node, MapNode):
            return
        known = self._accessed - set(node.entries)
        misspelled = [key for key in self._bad_keys if isinstance(key, str) and key in known]
        for key in self.unread_keys():
            if hints.did_you_mean(key, misspelled):
                continue  # part of the error about the missing key
            message = f'Entry {self._label()}contains unrecognized entry(s) {{"{key}"}}'
            hint = hints.unknown_key(key, known, self.name)
            self._collector.add(self._strict()._error(message, node.key_lines[key], hint))

    # -- errors of the caller --------------------------------------------------------------

    def error(self, message: str, hint: str = "") -> YamlError:
        """Returns an error about the node; see `YamlReader.error`."""
        error = super().error(message, hint)
        is_follow_up = self._is_stand_in or bool(self._bad_keys)
        return FollowUpError(error.message) if is_follow_up else _about(error, self._node)

    def invalid(self, key: Key, why: str) -> YamlError:
        """Returns an error about the value of an entry; see `YamlReader.invalid`."""
        error = self._strict().invalid(key, why)
        is_follow_up = self._is_stand_in or key in self._bad_keys
        node = self._find_quietly(key) or self._node
        return FollowUpError(error.message) if is_follow_up else _about(error, node)

    def warn(self, key: Key, what: str | Callable[[], str], hint: str = "") -> None:
        """Logs a warning about the value of an entry."""
        text = what if isinstance(what, str) else what()
        if not text:
            return
        entry = self._reader(self._find_quietly(key) or self._node, key)
        # Of an item, the name of the list.
        name = entry.name if isinstance(key, str) else re.findall(r'"\w*"', entry.location)[-1]
        _LOG.warning("%s is %s", name, text, extra={"place": entry.place, "hint": hint})

    def report(self, error: FlatlandError) -> None:
        """Adds an error; within `attempt`, raises the error."""
        if self._raises and not isinstance(error, FollowUpError):
            raise error
        self._collector.add(error)

    def collect_errors(self) -> AbstractContextManager[None]:
        """Returns a context in which an error ends only the block, and is added."""
        return self._collector.at(self.place)

    def collect_errors_of_model(self, name: str) -> AbstractContextManager[None]:
        """Returns a context for the loading of a model, whose errors may occur in others too."""
        return self._collector.model(name)

    def attempt(self, action: Callable[[Any], R]) -> R | None:
        """Returns the result of an action, which is repeated after each error about a value.

        Readers raise errors in the action, so that code that catches some of them works as usual.
        When the action is repeated, the readers return the default or a stand-in for the value.
        """
        collector = self._collector
        before = collector.found
        reader = self._derived(self._node, self.location, self.name)
        reader._accessed = self._accessed
        reader._raises = True
        texts: set[str] = set()
        while True:
            try:
                return action(reader)
            except FlatlandError as error:
                cause = error if isinstance(error, YamlError) else error.__cause__
                # Other exceptions may be raised because of a stand-in.
                if isinstance(cause, YamlError) or collector.found == before:
                    collector.add(error)
                is_new = isinstance(cause, _ValueError) and collector.mark(cause)
                if not is_new or error.message in texts:
                    return None
                texts.add(error.message)

    # -- other readers ---------------------------------------------------------------------

    def _strict(self) -> YamlReader:
        """Returns a reader of the same node, with the same record of keys, that raises errors."""
        reader = YamlReader(self._node, self.location, self.name)
        reader._accessed = self._accessed
        return reader

    def _derived(self, node: Node, location: str, name: str) -> Self:
        reader = type(self)(node, location, name).into(self._collector, stand_in=self._is_stand_in)
        reader._raises = self._raises
        return reader
