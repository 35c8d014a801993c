"""Copies of objects, which refer to each other like their originals."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from flatland.copying.kinds import Kind, kind_of

T = TypeVar("T")


class Copier:
    """Copies objects with everything that they refer to; each object is copied once.

    Attributes:
        memo: The copies so far by the id of the original, as for `__deepcopy__`.
    """

    def __init__(self, kinds: dict[type[Any], Kind]) -> None:
        """Creates a copier.

        Args:
            kinds: The kinds of classes found so far; it is extended.
        """
        self.memo: dict[int, Any] = {}
        self._kinds = kinds
        # Kept alive, because the id of a deleted object can be used again.
        self._originals: list[object] = []
        # Copies without contents. They are not completed by recursion, which would overflow for
        # long chains.
        self._pending: deque[tuple[Kind, Any, Any]] = deque()
        self._containers: list[Callable[[], None]] = []
        self._states: list[Callable[[], None]] = []

    def add(self, original: object, copy: T) -> T:
        """Registers the copy of an object and returns it."""
        self.memo[id(original)] = copy
        self._originals.append(original)
        return copy

    def find(self, original: object) -> Any:
        """Returns the copy of an object, None if it has not been copied."""
        return self.memo.get(id(original))

    def __call__(self, obj: Any) -> Any:
        """Returns the copy of an object, which may be incomplete until `finish`.

        Raises:
            UncopyableError: The object cannot be copied.
        """
        kind = self._kinds.get(type(obj)) or self._new_kind(obj)
        if kind.is_immutable:
            return obj
        memo, key = self.memo, id(obj)
        if key in memo:
            return memo[key]
        made = kind.make(obj, self)
        # To make the parts of a tuple or the like may have made a copy of the tuple.
        if key in memo:
            return memo[key]
        memo[key] = made
        self._originals.append(obj)
        if made is not obj:
            self._pending.append((kind, obj, made))
        return made

    def each(self, objects: Iterable[Any]) -> list[Any]:
        """Returns the copies of several objects in order, like calls for each of them."""
        kinds, copies = self._kinds, []
        for obj in objects:
            kind = kinds.get(type(obj))
            is_immutable = kind is not None and kind.is_immutable
            copies.append(obj if is_immutable else self(obj))
        return copies

    def fill(self, original: object, made: object) -> None:
        """Completes an object that exists already as the copy of another one."""
        kind = self._kinds.get(type(original)) or self._new_kind(original)
        self._pending.append((kind, original, made))

    def complete(self) -> None:
        """Completes the copies so far, except for hashed containers."""
        while self._pending:
            kind, obj, made = self._pending.popleft()
            rest = kind.fill(obj, made, self)
            if rest is not None:
                (self._states if kind.is_last else self._containers).append(rest)

    def finish(self) -> None:
        """Completes all copies.

        Raises:
            UncopyableError: An object cannot be copied.
        """
        while self._pending or self._containers or self._states:
            self.complete()
            # An object is given its state when the containers in it are complete.
            rest, self._containers = self._containers, []
            if not rest:
                rest, self._states = self._states, []
            for action in rest:
                action()

    def _new_kind(self, obj: object) -> Kind:
        kind = self._kinds[type(obj)] = kind_of(obj)
        return kind
