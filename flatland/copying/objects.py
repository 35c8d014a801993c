"""Objects of classes that are written in Python."""

from __future__ import annotations

import types
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from flatland.copying.containers import CONTAINERS
from flatland.copying.kind import Kind, MutableKind, Opaque
from flatland.physics.handle import Handle

if TYPE_CHECKING:
    from flatland.copying.copier import Copier
    from flatland.copying.record import Recorder

_MISSING: Final = object()


class _Plain(MutableKind):
    """An object of a class that is written in Python: attributes and slots."""

    def __init__(self, cls: type[Any]) -> None:
        """Determines the slots of a class, and the attributes that are not part of its state."""
        self.cls = cls
        self.outside: dict[str, Callable[[], object]] = {}
        for base in reversed(cls.__mro__):
            self.outside |= vars(base).get("outside_state", {})
        self.slots = [
            member
            for base in cls.__mro__
            for name, member in vars(base).items()
            if isinstance(member, types.MemberDescriptorType) and name not in self.outside
        ]
        self.outside_slots = {
            name: self.outside[name]
            for base in cls.__mro__
            for name, member in vars(base).items()
            if isinstance(member, types.MemberDescriptorType) and name in self.outside
        }
        self.has_dict = bool(cls.__dictoffset__)

    def record(self, obj: Any, recorder: Recorder) -> None:
        if self.has_dict:
            attributes = {
                name: value for name, value in vars(obj).items() if name not in self.outside
            }
            recorder.add(self._write_attributes, obj, attributes)
            recorder.follow(attributes.values())
        if self.slots:
            values = [_slot(member, obj) for member in self.slots]
            recorder.add(self._write_slots, obj, values)
            recorder.follow(values)

    def _write_attributes(self, obj: Any, attributes: dict[str, Any]) -> None:
        current = vars(obj)
        for name in [n for n in current if n not in attributes and n not in self.outside]:
            del current[name]
        for name, value in attributes.items():
            if current.get(name, _MISSING) is not value:
                current[name] = value

    def _write_slots(self, obj: Any, values: list[Any]) -> None:
        for member, value in zip(self.slots, values, strict=True):
            if value is not _MISSING:
                member.__set__(obj, value)
            elif _slot(member, obj) is not _MISSING:
                member.__delete__(obj)

    def copy(self, obj: Any, copier: Copier) -> Any:
        made = copier.add(obj, object.__new__(self.cls))
        copier.later(lambda: self.fill(obj, made, copier))
        return made

    def fill(self, obj: Any, made: Any, copier: Copier) -> None:
        """Sets the attributes of a copy."""
        if self.has_dict:
            attributes = vars(made)
            for name, value in vars(obj).items():
                make = self.outside.get(name)
                attributes[name] = copier.copy(value) if make is None else make()
        for member in self.slots:
            value = _slot(member, obj)
            if value is not _MISSING:
                member.__set__(made, copier.copy(value))
        for name, outside in self.outside_slots.items():
            object.__setattr__(made, name, outside())


def _slot(member: types.MemberDescriptorType, obj: object) -> Any:
    try:
        return member.__get__(obj)
    except AttributeError:
        return _MISSING


class _PhysicsHandle(_Plain):
    """A handle of a physics object, whose hash must be valid from the start."""

    def copy(self, obj: Any, copier: Copier) -> Any:
        made = copier.add(obj, object.__new__(self.cls))
        made.id, made._core = obj.id, copier.copy(obj._core)
        copier.later(lambda: self.fill(obj, made, copier))
        return made


class _Container(_Plain):
    """An object of a class that is derived from a container."""

    def __init__(self, cls: type[Any], base: type[Any], kind: Kind) -> None:
        super().__init__(cls)
        self._base = base
        self._kind = kind

    def record(self, obj: Any, recorder: Recorder) -> None:
        self._kind.record(obj, recorder)
        super().record(obj, recorder)

    def copy(self, obj: Any, copier: Copier) -> Any:
        new: Any = self._base.__new__
        made = copier.add(obj, new(self.cls))

        def fill() -> None:
            self.fill(obj, made, copier)
            if isinstance(obj, dict):
                items = [(copier.copy(key), copier.copy(value)) for key, value in obj.items()]
                copier.at_end(lambda: dict.update(made, items))
            elif isinstance(obj, list):
                list.extend(made, [copier.copy(item) for item in obj])
            else:
                members = [copier.copy(item) for item in obj]
                copier.at_end(lambda: set.update(made, members))

        copier.later(fill)
        return made


class _Stateful(MutableKind):
    """An object that defines `__getstate__`, whose result is saved and copied instead."""

    def __init__(self, cls: type[Any]) -> None:
        self._cls = cls

    def record(self, obj: Any, recorder: Recorder) -> None:
        state = obj.__getstate__()
        # Before the state itself is written back: `__setstate__` is called last.
        recorder.add_last(set_state, obj, state)
        recorder.follow((state,))

    def copy(self, obj: Any, copier: Copier) -> Any:
        made = copier.add(obj, object.__new__(self._cls))
        state = obj.__getstate__()

        def fill() -> None:
            mapped = copier.copy(state)
            # After the containers in the state have been filled.
            copier.at_end(lambda: copier.at_end(lambda: set_state(made, mapped)))

        copier.later(fill)
        return made


def set_state(obj: Any, state: Any) -> None:
    """Applies the result of `__getstate__` to an object, as the modules copy and pickle do."""
    if hasattr(obj, "__setstate__"):
        obj.__setstate__(state)
        return
    attributes, slots = state if isinstance(state, tuple) and len(state) == 2 else (state, None)
    vars(obj).update(attributes or {})
    for name, value in (slots or {}).items():
        setattr(obj, name, value)


def kind_of_object(obj: object) -> Kind:
    """Returns the kind of the objects of a class that is not one of the standard ones."""
    cls: type[Any] = type(obj)
    if issubclass(cls, Handle):
        return _PhysicsHandle(cls)
    if cls.__getstate__ is not vars(object)["__getstate__"]:
        return _Stateful(cls)
    if issubclass(cls, dict | list | set):
        base, kind = next((b, k) for b, k in reversed(CONTAINERS) if issubclass(cls, b))
        return _Container(cls, base, kind)
    if any(hasattr(cls, name) for name in ("__deepcopy__", "__copy__")) or any(
        getattr(cls, name) is not vars(object)[name] for name in ("__reduce__", "__reduce_ex__")
    ):
        return Opaque()
    try:
        object.__reduce_ex__(obj, 2)  # raises if there is more to an object than attributes
    except TypeError:
        return Opaque()
    return _Plain(cls)
