"""Functions and methods, with the variables that they refer to."""

from __future__ import annotations

import functools
import types
import weakref
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

from flatland.copying.kind import Kind, MutableKind

if TYPE_CHECKING:
    from flatland.copying.copier import Copier
    from flatland.copying.record import Recorder

_MISSING: Final = object()


class _Method(MutableKind):
    """A method bound to an object."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow((obj.__self__, obj.__func__))

    def copy(self, obj: Any, copier: Copier) -> Any:
        owner = copier.copy(obj.__self__)
        function = copier.copy(obj.__func__)
        if owner is obj.__self__ and function is obj.__func__:
            return obj
        return copier.add(obj, types.MethodType(function, owner))


class _BuiltinMethod(MutableKind):
    """A method of a built-in class bound to an object, such as `items.append`."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow((obj.__self__,))

    def copy(self, obj: Any, copier: Copier) -> Any:
        owner = copier.copy(obj.__self__)
        return obj if owner is obj.__self__ else copier.add(obj, getattr(owner, obj.__name__))


class _Function(MutableKind):
    """A function; the variables and default arguments that it refers to are followed."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow(_referred(obj))

    def copy(self, obj: Any, copier: Copier) -> Any:
        if not copier.has_state(_referred(obj)):
            return obj
        made = types.FunctionType(
            obj.__code__,
            obj.__globals__,
            obj.__name__,
            closure=tuple(copier.copy(cell) for cell in obj.__closure__ or ()) or None,
        )
        copier.add(obj, made)

        def fill() -> None:
            made.__defaults__ = copier.copy(obj.__defaults__)
            made.__kwdefaults__ = copier.copy(obj.__kwdefaults__)
            made.__dict__.update(obj.__dict__)
            made.__qualname__, made.__module__ = obj.__qualname__, obj.__module__

        copier.later(fill)
        return made


def _referred(function: types.FunctionType) -> Iterable[object]:
    return (
        *(function.__closure__ or ()),
        *(function.__defaults__ or ()),
        *(function.__kwdefaults__ or {}).values(),
    )


class _Cell(MutableKind):
    """A variable of an enclosing function."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        content = _content_of(obj)
        recorder.add(self._write, obj, content)
        recorder.follow((content,))

    @staticmethod
    def _write(obj: Any, content: object) -> None:
        if content is not _MISSING:
            obj.cell_contents = content

    def copy(self, obj: Any, copier: Copier) -> Any:
        made = copier.add(obj, types.CellType())
        content = _content_of(obj)
        copier.later(lambda: self._write(made, copier.copy(content)))
        return made


def _content_of(cell: types.CellType) -> object:
    try:
        return cell.cell_contents
    except ValueError:  # not assigned yet
        return _MISSING


class _Partial(MutableKind):
    """A `functools.partial`."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow((obj.func, obj.args, obj.keywords))

    def copy(self, obj: Any, copier: Copier) -> Any:
        function, arguments = copier.copy(obj.func), copier.copy(obj.args)
        keywords = {key: copier.copy(value) for key, value in obj.keywords.items()}
        return copier.add(obj, functools.partial(function, *arguments, **keywords))


class _WeakReference(MutableKind):
    """A weak reference."""

    def copy(self, obj: Any, copier: Copier) -> Any:
        target = obj()
        return obj if target is None else copier.add(obj, weakref.ref(copier.copy(target)))


FUNCTIONS: Final[tuple[tuple[tuple[type[Any], ...], Kind], ...]] = (
    ((types.MethodType,), _Method()),
    ((types.BuiltinFunctionType, types.MethodWrapperType), _BuiltinMethod()),
    ((types.FunctionType,), _Function()),
    ((types.CellType,), _Cell()),
    ((functools.partial,), _Partial()),
    ((weakref.ReferenceType,), _WeakReference()),
)
"""The kinds of functions and references."""
