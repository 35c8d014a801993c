"""The contents of objects, saved to be written back into the same objects."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from flatland.copying.kinds import Kind, kind_of


class SavedObjects:
    """The contents of objects and of all objects that they refer to.

    The identity of the objects is kept: references to them, also from closures, remain valid
    after the contents were written back, which can be done many times.

    Attributes:
        outside: The objects found that connect a plugin to the outside of the world.
    """

    def __init__(
        self,
        objects: Iterable[object],
        kinds: dict[type[Any], Kind],
        excluded: Iterable[object] = (),
    ) -> None:
        """Saves objects.

        Args:
            objects: The objects.
            kinds: The kinds of classes found so far; it is extended.
            excluded: Objects that are not saved.

        Raises:
            UncopyableError: An object has a state that cannot be read.
        """
        self.outside: list[object] = []
        entries: list[tuple[Kind, Any, Any]] = []
        last: list[tuple[Kind, Any, Any]] = []
        kept: list[object] = []
        excluded = tuple(excluded)
        seen, pending = set(map(id, excluded)), list(objects)
        while pending:
            obj = pending.pop()
            kind = kinds.get(type(obj))
            if kind is None:
                if id(obj) in seen:
                    continue
                kind = kinds[type(obj)] = kind_of(obj)
            if kind.is_immutable or id(obj) in seen:
                continue
            seen.add(id(obj))
            if kind.is_outside:
                self.outside.append(obj)
                continue
            content, parts = kind.take(obj)
            pending.extend(parts)
            if kind.is_last:
                last.append((kind, obj, content))
            elif kind.is_written:
                entries.append((kind, obj, content))
            else:
                kept.append(obj)  # An id must not be used again while others are saved.
        self._entries, self._last = entries, last

    def __len__(self) -> int:
        """Returns the number of objects whose contents were saved."""
        return len(self._entries) + len(self._last)

    def write_back(self) -> Exception | None:
        """Writes the contents back.

        Returns:
            The first exception of a `__setstate__`, None if there was none.
        """
        for kind, obj, content in self._entries:
            kind.put(obj, content)
        first: Exception | None = None
        for kind, obj, content in self._last:
            try:
                kind.put(obj, content)
            except Exception as error:
                first = first or error
        return first
