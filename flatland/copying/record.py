"""The contents of objects, saved to be written back into the same objects."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from flatland.copying.kinds import MISSING, Kind, kind_of
from flatland.physics import restore_contents


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
        compared = [(entry, entry[0].compared(*entry[1:])) for entry in entries]
        self._entries = [entry for entry, contents in compared if contents is None]
        self._compared = [entry for entry, contents in compared if contents is not None]
        self._contents = [contents for _, contents in compared if contents is not None]
        self._last = last

    def __len__(self) -> int:
        """Returns the number of objects whose contents were saved."""
        return len(self._entries) + len(self._compared) + len(self._last)

    def write_back(self) -> Exception | None:
        """Writes the contents back.

        Returns:
            The first exception of a `__setstate__`, None if there was none.
        """
        for index in restore_contents(self._contents, MISSING):
            kind, obj, content = self._compared[index]
            kind.put(obj, content)
        for kind, obj, content in self._entries:
            kind.put(obj, content)
        first: Exception | None = None
        for kind, obj, content in self._last:
            try:
                kind.put(obj, content)
            except Exception as error:
                first = first or error
        return first
