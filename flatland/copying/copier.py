"""Copies of all objects of a world, which refer to each other like their originals."""

from __future__ import annotations

import types
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, TypeVar

from flatland.copying.classes import kind_of
from flatland.copying.kind import Kind

T = TypeVar("T")


class Copier:
    """Copies objects with everything that they refer to; each object is copied once."""

    def __init__(self, kinds: dict[type[Any], Kind]) -> None:
        """Creates a copier.

        Args:
            kinds: The kinds of classes found so far; it is extended.
        """
        self._kinds = kinds
        # The original is kept alive, because the id of a deleted object can be reused.
        self._copies: dict[int, tuple[object, Any]] = {}
        self._pending: deque[Callable[[], object]] = deque()
        self._last: list[Callable[[], object]] = []

    def add(self, original: object, copy: T) -> T:
        """Registers the copy of an object and returns it."""
        self._copies[id(original)] = (original, copy)
        return copy

    def find(self, original: object) -> Any:
        """Returns the copy of an object, None if it has not been copied."""
        found = self._copies.get(id(original))
        return None if found is None else found[1]

    def copy(self, obj: Any) -> Any:
        """Returns the copy of an object, which may still be incomplete.

        Raises:
            UncopyableError: It cannot be copied.
        """
        kind = self._kind(obj)
        if kind.is_immutable and id(obj) not in self._copies:
            return obj
        found = self._copies.get(id(obj))
        return kind.copy(obj, self) if found is None else found[1]

    def later(self, action: Callable[[], object]) -> None:
        """Schedules a function that completes a copy; recursion would overflow for long chains."""
        self._pending.append(action)

    def at_end(self, action: Callable[[], object]) -> None:
        """Schedules a function for when all copies have their attributes."""
        self._last.append(action)

    def finish(self) -> None:
        """Completes all copies.

        Raises:
            UncopyableError: An object cannot be copied.
        """
        while self._pending or self._last:
            while self._pending:
                self._pending.popleft()()
            last, self._last = self._last, []
            for action in last:
                action()

    def has_state(self, objects: Iterable[object]) -> bool:
        """Returns whether some objects are or refer to more than immutable objects and functions.

        Other functions are followed, but not the contents of other objects.
        """
        pending, seen = list(objects), set[int]()
        while pending:
            obj = pending.pop()
            if id(obj) in seen or (self._kind(obj).is_immutable and id(obj) not in self._copies):
                continue
            seen.add(id(obj))
            if isinstance(obj, types.FunctionType):
                pending += [
                    *(obj.__closure__ or ()),
                    *(obj.__defaults__ or ()),
                    *(obj.__kwdefaults__ or {}).values(),
                ]
            elif isinstance(obj, types.BuiltinFunctionType):
                pending.append(obj.__self__)
            elif isinstance(obj, types.CellType):
                with suppress(ValueError):  # not assigned yet
                    pending.append(obj.cell_contents)
            elif type(obj) is tuple:
                pending += obj
            else:
                return True
        return False

    def _kind(self, obj: object) -> Kind:
        cls = type(obj)
        kind = self._kinds.get(cls)
        if kind is None:
            kind = self._kinds[cls] = kind_of(obj)
        return kind
