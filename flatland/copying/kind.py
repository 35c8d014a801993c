"""The base class of the kinds of objects.

Each class of objects has a kind, which saves the contents of an object, writes them back, and
copies the object. Plugins need no code for this. A class declares attributes that are not part of
the simulated state, such as locks and subscribers, in a dictionary `outside_state`: it maps their
names to functions that return their values in a copied world.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flatland.copying.copier import Copier
    from flatland.copying.record import Recorder


class UncopyableError(Exception):
    """An object can neither be saved nor copied; the text describes it."""


class Kind:
    """How objects are saved, written back and copied; this one is for immutable objects.

    Attributes:
        is_immutable: Whether the objects, and all that they refer to, never change.
    """

    is_immutable = True

    def record(self, obj: Any, recorder: Recorder) -> None:
        """Saves the contents of an object, and follows its references to other objects.

        Raises:
            UncopyableError: The object has a state that cannot be read.
        """

    def copy(self, obj: Any, copier: Copier) -> Any:
        """Returns the object of a copied world that corresponds to an object.

        Raises:
            UncopyableError: The object cannot be copied.
        """
        del copier
        return obj


class MutableKind(Kind):
    """Base class of the kinds of objects that change, or refer to others that change."""

    is_immutable = False


class Connection(MutableKind):
    """Connections to the outside of a world: not changed by a restore, and not copied."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        """Records the connection."""
        recorder.outside.append(obj)

    def copy(self, obj: Any, copier: Copier) -> Any:
        """Raises `UncopyableError`."""
        del copier
        raise uncopyable(obj)


class Opaque(MutableKind):
    """Objects with a state that cannot be read."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        """Raises `UncopyableError`."""
        del recorder
        raise uncopyable(obj)

    def copy(self, obj: Any, copier: Copier) -> Any:
        """Raises `UncopyableError`."""
        del copier
        raise uncopyable(obj)


class Lock(MutableKind):
    """A lock: a copied world has one of its own, which is free."""

    def copy(self, obj: Any, copier: Copier) -> Any:
        """Returns a new lock."""
        return copier.add(obj, type(obj)())


def uncopyable(obj: object) -> UncopyableError:
    """Returns the error for an object."""
    cls = type(obj)
    name = cls.__name__ if cls.__module__ == "builtins" else f"{cls.__module__}.{cls.__name__}"
    return UncopyableError(f"an object of type {name}")
