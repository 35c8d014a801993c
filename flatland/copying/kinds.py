"""How the objects of each class are saved, written back and copied.

Each class of objects has a kind. Plugins need no code for this. A class declares attributes that
are not part of the simulated state, such as locks and subscribers, in a dictionary `outside_state`:
it maps their names to functions that return their values in a copied world. A class whose objects
are to be saved and copied in another way defines `__getstate__` and `__setstate__`.
"""

from __future__ import annotations

import array
import collections
import dataclasses
import datetime
import enum
import fractions
import functools
import gc
import itertools
import logging
import numbers
import operator
import pathlib
import random
import re
import threading
import types
import uuid
import weakref
from collections.abc import Callable, Iterable
from typing import Any, Final, Protocol

import numpy as np

from flatland.config.node import Source
from flatland.config.reader import YamlReader
from flatland.physics import Handle, PhysicsWorld
from flatland.uncopied import refuse_copy

MISSING: Final = object()
"""Value of a slot or a cell that is not set."""


class UncopyableError(Exception):
    """An object can neither be saved nor copied; the text describes it."""

    def __init__(self, obj: object) -> None:
        """Creates the error for an object."""
        cls = type(obj)
        is_builtin = cls.__module__ == "builtins"
        name = cls.__name__ if is_builtin else f"{cls.__module__}.{cls.__name__}"
        super().__init__(f"an object of type {name}")


class Copy(Protocol):
    """Copies objects for a kind; implemented by `Copier`.

    Attributes:
        memo: The copies so far by the id of the original, as for `__deepcopy__`.
    """

    memo: dict[int, Any]

    def __call__(self, obj: Any) -> Any:
        """Returns the copy of an object, which may still be incomplete."""

    def each(self, objects: Iterable[Any]) -> list[Any]:
        """Returns the copies of several objects in order."""

    def complete(self) -> None:
        """Completes the copies so far, except for hashed containers."""


class Kind:
    """How objects are saved, written back and copied; this one is for immutable objects.

    Attributes:
        is_immutable: Whether the objects, and all that they refer to, never change.
        is_written: Whether `put` does anything.
        is_outside: Whether the objects connect a plugin to something outside the world.
        is_last: Whether objects are written back and completed after all others.
    """

    is_immutable = False
    is_written = True
    is_outside = False
    is_last = False

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        """Returns the contents of an object for `put`, and the objects that it refers to.

        Raises:
            UncopyableError: The object has a state that cannot be read.
        """
        raise UncopyableError(obj)

    def put(self, obj: Any, content: Any) -> None:
        """Writes contents back into an object."""

    def compared(self, obj: Any, content: Any) -> tuple[Any, ...] | None:  # noqa: ARG002
        """Returns what `flatland.physics.restore_contents` compares; None to write in any case."""
        return None

    def new(self, obj: Any) -> Any:
        """Returns an empty object for the copy of an object.

        Raises:
            UncopyableError: The object cannot be copied.
        """
        raise UncopyableError(obj)

    def make(self, obj: Any, copy: Copy) -> Any:  # noqa: ARG002
        """Returns the copy of an object; `fill` completes it.

        Raises:
            UncopyableError: The object, or one that it refers to, cannot be copied.
        """
        return self.new(obj)

    def fill(self, obj: Any, made: Any, copy: Copy) -> Callable[[], None] | None:
        """Completes the copy of an object.

        Returns:
            The rest of it, for when all copies have their attributes; None if there is none.
        """


class _Immutable(Kind):
    """Objects that never change, like all that they refer to."""

    is_immutable = True


class _Connection(Kind):
    """Connections to the outside of a world: not changed by a restore, and not copied."""

    is_outside = True


class _Fixed(Kind):
    """Objects that never change but refer to others that do; their copies are complete."""

    is_written = False

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        return None, self.parts(obj)

    def parts(self, obj: Any) -> Iterable[Any]:  # noqa: ARG002
        """Returns the objects that an object refers to."""
        return ()


class _Lock(_Fixed):
    """A lock: a copied world has one of its own, which is free."""

    def new(self, obj: Any) -> Any:
        return type(obj)()


class _CoreObject(_Fixed):
    """An object of the extension: the copy of a handle refers to the copied core world."""

    def make(self, obj: Any, copy: Copy) -> Any:
        return obj.__deepcopy__(copy.memo) if hasattr(obj, "__deepcopy__") else obj


class _Composite(_Fixed):
    """Objects that consist of other objects, and can be made from copies of these."""

    def __init__(
        self,
        parts: Callable[[Any], Iterable[Any]],
        build: Callable[[Any, list[Any]], Any],
        *,
        is_hashed: bool = False,
    ) -> None:
        """Creates the kind.

        Args:
            parts: Returns the objects that an object consists of.
            build: Returns an object like the given one, from copies of its parts.
            is_hashed: Whether parts are hashed, so that their copies must have their attributes.
        """
        self._parts = parts
        self._build = build
        self._is_hashed = is_hashed

    def parts(self, obj: Any) -> Iterable[Any]:
        return self._parts(obj)

    def make(self, obj: Any, copy: Copy) -> Any:
        parts = list(self._parts(obj))
        copies = copy.each(parts)
        if all(map(operator.is_, parts, copies)):
            return obj
        if self._is_hashed:
            copy.complete()
        return self._build(obj, copies)


def _frozen_dataclass(cls: Any) -> Kind:
    """Returns the kind of a frozen dataclass, such as the values that plugins emit."""
    names = [field.name for field in dataclasses.fields(cls)]

    def build(_: Any, values: list[Any]) -> Any:
        made = object.__new__(cls)
        for name, value in zip(names, values, strict=True):
            object.__setattr__(made, name, value)
        return made

    return _Composite(lambda obj: [getattr(obj, name) for name in names], build)


def _view(method: str) -> Kind:
    """Returns the kind of the views of dictionaries that a method returns."""
    return _Composite(gc.get_referents, lambda _, viewed: getattr(viewed[0], method)())


class _WeakReference(_Fixed):
    """A weak reference."""

    def make(self, obj: Any, copy: Copy) -> Any:
        target = obj()
        return obj if target is None else weakref.ref(copy(target))


class _Function(_Fixed):
    """A function; the variables and default arguments that it refers to are followed."""

    def parts(self, obj: Any) -> Iterable[Any]:
        return (
            *(obj.__closure__ or ()),
            *(obj.__defaults__ or ()),
            *(obj.__kwdefaults__ or {}).values(),
        )

    def make(self, obj: Any, copy: Copy) -> Any:
        if not self.parts(obj):
            return obj
        cells = tuple(copy(cell) for cell in obj.__closure__ or ()) or None
        return types.FunctionType(obj.__code__, obj.__globals__, obj.__name__, closure=cells)

    def fill(self, obj: Any, made: Any, copy: Copy) -> None:
        if made is not obj:
            made.__defaults__ = copy(obj.__defaults__)
            made.__kwdefaults__ = copy(obj.__kwdefaults__)
            made.__dict__.update(obj.__dict__)
            made.__qualname__, made.__module__ = obj.__qualname__, obj.__module__


class _Cell(Kind):
    """A variable of an enclosing function."""

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        try:
            content = obj.cell_contents
        except ValueError:  # not assigned yet
            content = MISSING
        return content, (content,)

    def put(self, obj: Any, content: Any) -> None:
        if content is not MISSING:
            obj.cell_contents = content

    def new(self, obj: Any) -> Any:  # noqa: ARG002
        return types.CellType()

    def fill(self, obj: Any, made: Any, copy: Copy) -> None:
        self.put(made, copy(self.take(obj)[0]))


class _List(Kind):
    """A list or a deque.

    Contents are read and written by the methods of the base class in the standard library; methods
    of derived classes are not called.
    """

    def __init__(self, base: Any) -> None:
        self._base = base

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        items = list(obj)
        return items, items

    def put(self, obj: Any, content: Any) -> None:
        self._base.clear(obj)
        self._base.extend(obj, content)

    def compared(self, obj: Any, content: Any) -> tuple[Any, ...]:
        return _items_of(obj, content)

    def new(self, obj: Any) -> Any:
        made = self._base.__new__(type(obj))
        if self._base is collections.deque:
            self._base.__init__(made, (), obj.maxlen)
        return made

    def fill(self, obj: Any, made: Any, copy: Copy) -> None:
        self._base.extend(made, copy.each(obj))


class _Set(Kind):
    """A set."""

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        items = set(obj)
        return items, items

    def put(self, obj: Any, content: Any) -> None:
        set.clear(obj)
        set.update(obj, content)

    def compared(self, obj: Any, content: Any) -> tuple[Any, ...]:
        return _items_of(obj, content)

    def new(self, obj: Any) -> Any:
        return set.__new__(type(obj))

    def fill(self, obj: Any, made: Any, copy: Copy) -> Callable[[], None]:
        items = copy.each(obj)
        return lambda: set.update(made, items)


class _Dict(Kind):
    """A dictionary of any of the standard classes; see `_List` for the base class."""

    def __init__(self, base: Any) -> None:
        self._base = base
        # That of a Counter would add to the values.
        self._update = dict.update if base is collections.Counter else base.update

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        items = dict(obj)
        parts = [*items, *items.values()]
        if self._base is collections.defaultdict:
            parts.append(obj.default_factory)
        return items, parts

    def put(self, obj: Any, content: Any) -> None:
        self._base.clear(obj)
        self._update(obj, content)

    def compared(self, obj: Any, content: Any) -> tuple[Any, ...] | None:
        # The order of an OrderedDict is not that of the dict.
        is_ordered = self._base is collections.OrderedDict
        return None if is_ordered else _items_of(obj, content)

    def new(self, obj: Any) -> Any:
        return self._base.__new__(type(obj))

    def fill(self, obj: Any, made: Any, copy: Copy) -> Callable[[], None]:
        if self._base is collections.defaultdict:
            made.default_factory = copy(obj.default_factory)
        copies = copy.each(itertools.chain.from_iterable(obj.items()))
        items = list(zip(copies[::2], copies[1::2], strict=True))
        # The hash of a key may depend on what it contains.
        return lambda: self._update(made, items)


class _Array(Kind):
    """An array of numpy."""

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        if obj.dtype.hasobject:
            return obj.copy(), obj.ravel().tolist()
        return (obj.copy() if obj.flags.writeable else None), ()

    def put(self, obj: Any, content: Any) -> None:
        if obj.flags.writeable:
            obj[...] = content

    def make(self, obj: Any, copy: Copy) -> Any:
        if obj.dtype.hasobject:
            return np.empty_like(obj)
        if not obj.flags.writeable:
            return obj
        base = obj.base
        if isinstance(base, np.ndarray) and base.flags.writeable and base.size <= 2 * obj.size:
            # A view: of the copy of the same memory.
            offset = obj.__array_interface__["data"][0] - base.__array_interface__["data"][0]
            return np.ndarray(obj.shape, obj.dtype, copy(base), offset, obj.strides)
        return obj.copy()

    def fill(self, obj: Any, made: Any, copy: Copy) -> None:
        if obj.dtype.hasobject:
            for index in np.ndindex(obj.shape):
                made[index] = copy(obj[index])


@dataclasses.dataclass(frozen=True, slots=True)
class _Value(Kind):
    """An object that contains a value and refers to no other objects.

    Attributes:
        read: Returns a copy of the value of an object.
        write: Replaces the value of an object.
        empty: Returns an object with any value.
    """

    read: Callable[[Any], Any]
    write: Callable[[Any, Any], None]
    empty: Callable[[Any], Any]

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        return self.read(obj), ()

    def put(self, obj: Any, content: Any) -> None:
        self.write(obj, content)

    def new(self, obj: Any) -> Any:
        made = self.empty(obj)
        self.write(made, self.read(obj))
        return made


class _Object(Kind):
    """An object of a class that is written in Python: attributes, slots, and perhaps items."""

    def __init__(self, cls: type[Any]) -> None:
        self._cls = cls
        self._outside: dict[str, Callable[[], object]] = {}
        for base in reversed(cls.__mro__):
            self._outside |= vars(base).get("outside_state", {})
        members = [
            (name, member)
            for base in cls.__mro__
            for name, member in vars(base).items()
            if isinstance(member, types.MemberDescriptorType)
        ]
        self._slots = [member for name, member in members if name not in self._outside]
        self._outside_slots = [name for name, _ in members if name in self._outside]
        self._ignored, self._compared_slots = tuple(self._outside), tuple(self._slots)
        self._has_dict = bool(cls.__dictoffset__)
        containers = (_BY_CLASS[base] for base in cls.__mro__ if base in _BY_CLASS)
        self._items: Kind | None = next(containers, None)

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        attributes: dict[str, Any] = {}
        if self._has_dict:
            attributes = vars(obj).copy()
            for name in self._outside:
                attributes.pop(name, None)
        slots = [_slot(member, obj) for member in self._slots]
        parts = [*attributes.values(), *slots]
        if self._items is None:
            return (attributes, slots, None), parts
        items, more = self._items.take(obj)
        return (attributes, slots, items), [*parts, *more]

    def put(self, obj: Any, content: Any) -> None:
        attributes, slots, items = content
        if self._has_dict:
            current = vars(obj)
            for name in [n for n in current if n not in attributes and n not in self._outside]:
                del current[name]
            for name, value in attributes.items():
                if current.get(name, MISSING) is not value:
                    current[name] = value
        for member, value in zip(self._slots, slots, strict=True):
            if value is not MISSING:
                member.__set__(obj, value)
            elif _slot(member, obj) is not MISSING:
                member.__delete__(obj)
        if self._items is not None:
            self._items.put(obj, items)

    def compared(self, obj: Any, content: Any) -> tuple[Any, ...] | None:
        attributes, slots, items = content
        if self._items is not None and self._items.compared(obj, items) is None:
            return None
        saved = attributes if self._has_dict else None
        return obj, saved, self._ignored, self._compared_slots, slots, items

    def new(self, obj: Any) -> Any:
        return object.__new__(self._cls) if self._items is None else self._items.new(obj)

    def fill(self, obj: Any, made: Any, copy: Copy) -> Callable[[], None] | None:
        if self._has_dict:
            attributes, inside = vars(made), vars(obj).copy()
            for name, make in self._outside.items():
                if name in inside:
                    del inside[name]
                    attributes[name] = make()
            attributes.update(zip(inside, copy.each(inside.values()), strict=True))
        members, values = [], []
        for member in self._slots:
            try:
                values.append(member.__get__(obj))
            except AttributeError:  # not set
                continue
            members.append(member)
        for member, value in zip(members, copy.each(values), strict=True):
            member.__set__(made, value)
        for name in self._outside_slots:
            object.__setattr__(made, name, self._outside[name]())
        return None if self._items is None else self._items.fill(obj, made, copy)


class _PhysicsHandle(_Object):
    """A handle of a physics object, whose hash must be valid from the start."""

    def __init__(self, cls: type[Any]) -> None:
        super().__init__(cls)
        # The constructor of a derived class may have other arguments.
        core = (base for base in cls.__mro__ if base.__module__ == "flatland._core")
        self._base: Any = next(core, Handle)

    def make(self, obj: Any, copy: Copy) -> Any:
        made = self._base.__new__(type(obj))
        self._base.__init__(made, copy(obj.world), obj.id)
        return made


class _Stateful(Kind):
    """An object that defines `__getstate__`, whose result is saved and copied instead."""

    is_last = True

    def take(self, obj: Any) -> tuple[Any, Iterable[object]]:
        state = obj.__getstate__()
        return state, (state,)

    def put(self, obj: Any, content: Any) -> None:
        """Applies the result of `__getstate__`, as the modules copy and pickle do."""
        if hasattr(obj, "__setstate__"):
            obj.__setstate__(content)
            return
        is_pair = isinstance(content, tuple) and len(content) == 2
        attributes, slots = content if is_pair else (content, None)
        vars(obj).update(attributes or {})
        for name, value in (slots or {}).items():
            setattr(obj, name, value)

    def new(self, obj: Any) -> Any:
        return object.__new__(type(obj))

    def fill(self, obj: Any, made: Any, copy: Copy) -> Callable[[], None]:
        state = copy(obj.__getstate__())
        return lambda: self.put(made, state)


def _items_of(obj: Any, items: Any) -> tuple[Any, ...]:
    """Returns what is compared of a container without attributes."""
    return obj, None, (), (), [], items


def _slot(member: types.MemberDescriptorType, obj: object) -> Any:
    try:
        return member.__get__(obj)
    except AttributeError:
        return MISSING


# The kinds of the standard containers, not of classes derived from them.
_BY_CLASS: Final[dict[type[Any], Kind]] = {
    list: _List(list),
    collections.deque: _List(collections.deque),
    set: _Set(),
    dict: _Dict(dict),
    collections.OrderedDict: _Dict(collections.OrderedDict),
    collections.defaultdict: _Dict(collections.defaultdict),
    collections.Counter: _Dict(collections.Counter),
    frozenset: _Composite(tuple, lambda _, items: frozenset(items), is_hashed=True),
    type({}.keys()): _view("keys"),
    type({}.values()): _view("values"),
    type({}.items()): _view("items"),
}
_IMMUTABLE: Final = (
    *(type, types.ModuleType, types.NoneType, types.EllipsisType, types.NotImplementedType),
    *(numbers.Number, str, bytes, range, slice, enum.Enum, re.Pattern, pathlib.PurePath),
    *(fractions.Fraction, uuid.UUID, datetime.date, datetime.time, datetime.timedelta),
    *(datetime.tzinfo, np.generic, np.dtype, np.ufunc, logging.Logger, BaseException, property),
    *(operator.attrgetter, operator.itemgetter, operator.methodcaller, types.CodeType),
    *(types.GenericAlias, types.UnionType, types.MappingProxyType, types.GetSetDescriptorType),
    *(types.WrapperDescriptorType, types.MethodDescriptorType, types.MemberDescriptorType),
    # Parsed files never change.
    *(YamlReader, Source),
)
# The kinds of other standard classes, and of classes derived from them.
_BY_BASE: Final[tuple[tuple[tuple[type[Any], ...], Kind], ...]] = (
    (_IMMUTABLE, _Immutable()),
    ((np.ndarray,), _Array()),
    (
        (array.array, bytearray),
        _Value(
            lambda obj: obj[:],
            lambda obj, items: obj.__setitem__(slice(None), items),
            lambda obj: obj[:],
        ),
    ),
    (
        (np.random.Generator,),
        _Composite(lambda obj: [obj.bit_generator], lambda obj, parts: type(obj)(*parts)),
    ),
    (
        (np.random.BitGenerator,),
        _Value(
            lambda obj: obj.state,
            lambda obj, state: setattr(obj, "state", state),
            lambda obj: type(obj)(0),
        ),
    ),
    (
        (random.Random,),
        _Value(
            lambda obj: obj.getstate(),
            lambda obj, state: obj.setstate(state),
            lambda obj: type(obj)(),
        ),
    ),
    (
        (types.MethodType,),
        _Composite(
            lambda obj: (obj.__func__, obj.__self__), lambda _, parts: types.MethodType(*parts)
        ),
    ),
    (
        (types.BuiltinFunctionType, types.MethodWrapperType),  # such as `items.append`
        _Composite(lambda obj: [obj.__self__], lambda obj, parts: getattr(parts[0], obj.__name__)),
    ),
    ((types.FunctionType,), _Function()),
    ((types.CellType,), _Cell()),
    (
        (functools.partial,),
        _Composite(
            lambda obj: (obj.func, *obj.args, *obj.keywords.values()),
            lambda obj, parts: type(obj)(
                *parts[: 1 + len(obj.args)],
                **dict(zip(obj.keywords, parts[1 + len(obj.args) :], strict=True)),
            ),
        ),
    ),
    ((weakref.ReferenceType,), _WeakReference()),
    ((type(threading.Lock()), type(threading.RLock())), _Lock()),
    ((tuple,), _Composite(tuple, lambda obj, items: tuple.__new__(type(obj), items))),
)
# Objects of these packages and rooms connect a plugin to something outside the world.
_OUTSIDE: Final = re.compile(
    r"(asyncio|concurrent|_?io|multiprocessing|_?queue|rospy|selectors|_?socket|ssl|subprocess"
    r"|tf2_ros|threading|flatland\.(ros|recording|simulation))(\.|$)"
)


def kind_of(obj: object) -> Kind:
    """Returns the kind of the objects of a class.

    Args:
        obj: An object of the class.
    """
    cls: type[Any] = type(obj)
    found = _BY_CLASS.get(cls)
    if found is not None:
        return found
    if issubclass(cls, Handle):
        return _PhysicsHandle(cls)
    if issubclass(cls, PhysicsWorld):
        return _Object(cls)
    if cls.__module__ == "flatland._core":
        return _CoreObject()
    if cls is object:
        return _Immutable()
    for bases, kind in _BY_BASE:
        if issubclass(cls, bases):
            return kind
    if dataclasses.is_dataclass(cls) and getattr(cls, "__dataclass_params__").frozen:  # noqa: B009
        return _frozen_dataclass(cls)
    if _OUTSIDE.match(cls.__module__):
        return _Connection()
    if cls.__getstate__ is not vars(object)["__getstate__"]:
        return _Stateful()
    return _Object(cls) if _has_only_attributes(obj) else Kind()


def _has_only_attributes(obj: object) -> bool:
    """Returns whether there is no more to an object than attributes, slots and standard items."""
    cls = type(obj)
    if issubclass(cls, dict | list | set | collections.deque):
        return True
    if (
        any(hasattr(cls, name) for name in ("__deepcopy__", "__copy__"))
        or cls.__reduce__ is not vars(object)["__reduce__"]
        or cls.__reduce_ex__ not in (vars(object)["__reduce_ex__"], refuse_copy)
    ):
        return False
    try:
        object.__reduce_ex__(obj, 2)  # raises if there is more to it
    except TypeError:
        return False
    return True
