"""Objects that are parts of a world, and that neither `copy` nor `pickle` can copy alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn, TypeVar

C = TypeVar("C", bound=type[Any])


def uncopied(advice: str) -> Callable[[C], C]:
    """Returns a decorator for classes whose objects `copy` and `pickle` refuse.

    Snapshots and clones of worlds copy such objects nevertheless; see `flatland.copying`.

    Args:
        advice: What to do instead, for the error.
    """

    def mark(cls: C) -> C:
        cls.copy_advice = advice
        cls.__reduce_ex__ = refuse_copy  # type: ignore[assignment]
        return cls

    return mark


def refuse_copy(self: Any, _protocol: object) -> NoReturn:
    """Takes the place of `__reduce_ex__`.

    Raises:
        TypeError: In any case; the text names what to do instead.
    """
    raise TypeError(f"cannot copy or pickle {type(self).__name__} objects: {self.copy_advice}")
