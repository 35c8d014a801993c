"""Copies of environments, which are created again with the same arguments."""

from __future__ import annotations

from typing import Any, ClassVar, Self


class Recreated:
    """An environment that `pickle` and `copy.deepcopy` create again, also in another process.

    A copy has the arguments and the random number generators of the original. It has no episode:
    its first one begins with `reset`, and is the next one of the original if no seed is given.
    """

    kept_attributes: ClassVar[tuple[str, ...]] = ()

    _arguments: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls, *args: Any, **kwargs: Any) -> Self:
        """Stores the arguments of the constructor."""
        self = super().__new__(cls)
        self._arguments = (args, kwargs)
        return self

    def _replace_argument(self, name: str, value: Any) -> None:
        """Replaces a keyword argument of further copies."""
        args, kwargs = self._arguments
        self._arguments = (args, {**kwargs, name: value})

    def __reduce__(self) -> tuple[Any, ...]:
        """Returns the arguments, and the attributes that a copy keeps."""
        kept = {name: vars(self)[name] for name in self.kept_attributes if name in vars(self)}
        return _create, (type(self), *self._arguments), kept


def _create(kind: type[Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    return kind(*args, **kwargs)
