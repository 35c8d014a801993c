"""Records of the contents of all objects of a world, to be written back into the same objects."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from flatland.copying.classes import kind_of
from flatland.copying.kind import Kind

Write = Callable[[Any, Any], None]
Entry = tuple[Write, Any, Any]


class Recorder:
    """Saves the contents of objects and of all objects that they refer to.

    The identity of the objects is kept: references to them, including those of closures, remain
    valid after the contents were written back.

    Attributes:
        outside: The objects found that connect a plugin to the outside of the world.
    """

    def __init__(self, kinds: dict[type[Any], Kind], excluded: Iterable[object] = ()) -> None:
        """Creates a recorder.

        Args:
            kinds: The kinds of classes found so far; it is extended.
            excluded: Objects that are not saved.
        """
        self.outside: list[object] = []
        self._kinds = kinds
        self._excluded = tuple(excluded)
        self._seen = set(map(id, self._excluded))
        self._pending: list[object] = []
        self._written: list[Entry] = []
        self._last: list[Entry] = []

    def follow(self, objects: Iterable[object]) -> None:
        """Saves further objects, which saved objects must keep alive."""
        self._pending.extend(objects)

    def add(self, write: Write, obj: Any, content: Any) -> None:
        """Adds the content of an object, and the function that writes it back."""
        self._written.append((write, obj, content))

    def add_last(self, write: Write, obj: Any, content: Any) -> None:
        """Adds content that is written back after all other content."""
        self._last.append((write, obj, content))

    def record(self, objects: Iterable[object]) -> StateRecord:
        """Saves objects and everything that they refer to.

        Raises:
            UncopyableError: An object has a state that cannot be read.
        """
        kinds, seen, pending = self._kinds, self._seen, self._pending
        pending.extend(objects)
        while pending:
            obj = pending.pop()
            cls = type(obj)
            kind = kinds.get(cls)
            if kind is None:
                if id(obj) in seen:
                    continue
                kind = kinds[cls] = kind_of(obj)
            if kind.is_immutable or id(obj) in seen:
                continue
            seen.add(id(obj))
            kind.record(obj, self)
        return StateRecord(self._written, self._last)


class StateRecord:
    """Contents of objects; they can be written back many times."""

    def __init__(self, entries: list[Entry], last: list[Entry]) -> None:
        """Creates a record.

        Args:
            entries: Functions that write a content back, with the object and the content.
            last: Calls of `__setstate__`, performed after all contents were written back.
        """
        self._entries = entries
        self._last = last

    def write_back(self) -> Exception | None:
        """Writes the contents back.

        Returns:
            The first exception of a `__setstate__`, None if there was none.
        """
        for write, obj, content in self._entries:
            write(obj, content)
        first: Exception | None = None
        for write, obj, content in self._last:
            try:
                write(obj, content)
            except Exception as error:
                first = first or error
        return first
