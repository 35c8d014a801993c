"""The kind of each class of objects."""

from __future__ import annotations

import dataclasses
import datetime
import enum
import fractions
import logging
import numbers
import operator
import pathlib
import re
import threading
import types
import uuid
from typing import Any, Final

import numpy as np

from flatland.config.node import Source
from flatland.config.tree_reader import TreeReader
from flatland.copying.containers import ARRAYS, CONTAINERS, FROZEN_DATACLASS, NAMED_TUPLE
from flatland.copying.functions import FUNCTIONS
from flatland.copying.kind import Connection, Kind, Lock
from flatland.copying.objects import kind_of_object
from flatland.copying.random_numbers import GENERATORS

# Objects of these packages connect a plugin to something outside the world.
_OUTSIDE_PACKAGES: Final = frozenset(
    [
        "asyncio",
        "concurrent",
        "io",
        "_io",
        "multiprocessing",
        "queue",
        "_queue",
        "rospy",
        "selectors",
        "socket",
        "_socket",
        "ssl",
        "subprocess",
        "tf2_ros",
        "threading",
    ]
)
_OUTSIDE_ROOMS: Final = ("flatland.ros", "flatland.recording", "flatland.simulation")
_IMMUTABLE: Final = (
    *(type, types.ModuleType, types.NoneType, types.EllipsisType, types.NotImplementedType),
    *(numbers.Number, str, bytes, range, slice, enum.Enum, re.Pattern, pathlib.PurePath),
    *(fractions.Fraction, uuid.UUID, datetime.date, datetime.time, datetime.timedelta),
    *(datetime.tzinfo, np.generic, np.dtype, np.ufunc, logging.Logger, BaseException, property),
    *(operator.attrgetter, operator.itemgetter, operator.methodcaller, types.CodeType),
    *(types.GenericAlias, types.UnionType, types.MappingProxyType, types.GetSetDescriptorType),
    *(types.WrapperDescriptorType, types.MethodDescriptorType, types.MemberDescriptorType),
    # Parsed files never change.
    *(TreeReader, Source),
)
_KINDS: Final[tuple[tuple[tuple[type[Any], ...], Kind], ...]] = (
    *ARRAYS,
    *GENERATORS,
    *FUNCTIONS,
    ((type(threading.Lock()), type(threading.RLock())), Lock()),
    ((tuple,), NAMED_TUPLE),
)


def kind_of(obj: object) -> Kind:
    """Returns the kind of the objects of a class.

    Args:
        obj: An object of the class.
    """
    cls: type[Any] = type(obj)
    for container, kind in CONTAINERS:
        if cls is container:
            return kind
    if cls is object or cls.__module__ == "flatland._core" or issubclass(cls, _IMMUTABLE):
        return Kind()
    for classes, kind in _KINDS:
        if issubclass(cls, classes):
            return kind
    if dataclasses.is_dataclass(cls) and getattr(cls, "__dataclass_params__").frozen:  # noqa: B009
        return FROZEN_DATACLASS
    module = cls.__module__
    if module.partition(".")[0] in _OUTSIDE_PACKAGES or module.startswith(_OUTSIDE_ROOMS):
        return Connection()
    return kind_of_object(obj)
