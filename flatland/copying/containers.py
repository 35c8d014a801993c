"""Containers of other objects, and arrays of numbers."""

from __future__ import annotations

import array
import collections
import dataclasses
import gc
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.copying.kind import Kind, MutableKind

if TYPE_CHECKING:
    from flatland.copying.copier import Copier
    from flatland.copying.record import Recorder

_VIEWS: Final[dict[type[Any], str]] = {
    type({}.keys()): "keys",
    type({}.values()): "values",
    type({}.items()): "items",
}


class _Tuple(MutableKind):
    """A tuple or a named tuple."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow(obj)

    def copy(self, obj: Any, copier: Copier) -> Any:
        items = [copier.copy(item) for item in obj]
        if all(one is other for one, other in zip(items, obj, strict=True)):
            return obj
        cls = type(obj)
        return copier.add(obj, tuple(items) if cls is tuple else tuple.__new__(cls, items))


class _FrozenSet(MutableKind):
    """A frozen set."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow(obj)

    def copy(self, obj: Any, copier: Copier) -> Any:
        return copier.add(obj, frozenset([copier.copy(item) for item in obj]))


class _FrozenDataclass(MutableKind):
    """A frozen dataclass, such as the values that plugins emit."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow(self._values(obj))

    def copy(self, obj: Any, copier: Copier) -> Any:
        values = self._values(obj)
        copies = [copier.copy(value) for value in values]
        if all(one is other for one, other in zip(copies, values, strict=True)):
            return obj
        made = object.__new__(type(obj))
        for field, value in zip(dataclasses.fields(obj), copies, strict=True):
            object.__setattr__(made, field.name, value)
        return copier.add(obj, made)

    @staticmethod
    def _values(obj: Any) -> list[Any]:
        return [getattr(obj, field.name) for field in dataclasses.fields(obj)]


class _List(MutableKind):
    """A list or a `deque`."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        items = list(obj)
        recorder.add(self._write, obj, items)
        recorder.follow(items)

    @staticmethod
    def _write(obj: Any, items: list[Any]) -> None:
        obj.clear()
        obj.extend(items)

    def copy(self, obj: Any, copier: Copier) -> Any:
        maxlen = getattr(obj, "maxlen", None)
        made: Any = copier.add(obj, [] if type(obj) is list else collections.deque(maxlen=maxlen))
        copier.later(lambda: made.extend([copier.copy(item) for item in obj]))
        return made


class _Dict(MutableKind):
    """A dictionary of any of the standard classes."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        items = dict(obj)
        recorder.add(self._write, obj, items)
        recorder.follow(items)
        recorder.follow(items.values())
        if isinstance(obj, collections.defaultdict):
            recorder.follow((obj.default_factory,))

    @staticmethod
    def _write(obj: Any, items: dict[Any, Any]) -> None:
        dict.clear(obj)
        dict.update(obj, items)

    def copy(self, obj: Any, copier: Copier) -> Any:
        cls = type(obj)
        is_default = cls is collections.defaultdict
        made = copier.add(obj, cls(copier.copy(obj.default_factory)) if is_default else cls())

        def fill() -> None:
            items = [(copier.copy(key), copier.copy(value)) for key, value in obj.items()]
            # The hash of a key may depend on what it contains. A Counter would add counts.
            copier.at_end(lambda: dict.update(made, items))

        copier.later(fill)
        return made


class _Set(MutableKind):
    """A set."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        items = set(obj)
        recorder.add(self._write, obj, items)
        recorder.follow(items)

    @staticmethod
    def _write(obj: Any, items: set[Any]) -> None:
        obj.clear()
        obj.update(items)

    def copy(self, obj: Any, copier: Copier) -> Any:
        made: set[Any] = copier.add(obj, set())

        def fill() -> None:
            items = [copier.copy(item) for item in obj]
            copier.at_end(lambda: made.update(items))

        copier.later(fill)
        return made


class _View(MutableKind):
    """A view of a dictionary, such as `items.keys()`."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow(gc.get_referents(obj))

    def copy(self, obj: Any, copier: Copier) -> Any:
        (viewed,) = gc.get_referents(obj)
        return copier.add(obj, getattr(copier.copy(viewed), _VIEWS[type(obj)])())


class _Array(MutableKind):
    """An array of numpy or of the module `array`, or a `bytearray`; a read-only array is shared."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        if isinstance(obj, np.ndarray):
            if obj.dtype.hasobject:
                recorder.follow(obj.ravel().tolist())
            elif not obj.flags.writeable:
                return
            recorder.add(self._write_numpy, obj, obj.copy())
        else:
            recorder.add(self._write, obj, obj[:])

    @staticmethod
    def _write_numpy(obj: Any, content: Any) -> None:
        if obj.flags.writeable:
            obj[...] = content

    @staticmethod
    def _write(obj: Any, content: Any) -> None:
        obj[:] = content

    def copy(self, obj: Any, copier: Copier) -> Any:
        if not isinstance(obj, np.ndarray):
            return copier.add(obj, obj[:])
        if obj.dtype.hasobject:
            made = copier.add(obj, np.empty_like(obj))
            for index in np.ndindex(obj.shape):
                made[index] = copier.copy(obj[index])
            return made
        if not obj.flags.writeable:
            return obj
        base = obj.base
        if isinstance(base, np.ndarray) and base.flags.writeable and base.size <= 2 * obj.size:
            # A view: of the copy of the same memory.
            whole = copier.copy(base)
            offset = obj.__array_interface__["data"][0] - base.__array_interface__["data"][0]
            view: Any = np.ndarray(obj.shape, obj.dtype, whole, offset, obj.strides)
            return copier.add(obj, view)
        return copier.add(obj, obj.copy())


CONTAINERS: Final[tuple[tuple[type[Any], Kind], ...]] = (
    (tuple, _Tuple()),
    (frozenset, _FrozenSet()),
    (list, _List()),
    (collections.deque, _List()),
    (set, _Set()),
    (dict, _Dict()),
    *((view, _View()) for view in _VIEWS),
    (collections.OrderedDict, _Dict()),
    (collections.defaultdict, _Dict()),
    (collections.Counter, _Dict()),
)
"""The kinds of the standard containers, not of classes derived from them."""
NAMED_TUPLE: Final = _Tuple()
FROZEN_DATACLASS: Final = _FrozenDataclass()
ARRAYS: Final[tuple[tuple[tuple[type[Any], ...], Kind], ...]] = (
    ((np.ndarray, array.array, bytearray), _Array()),
)
"""The kinds of arrays, also of classes derived from them."""
