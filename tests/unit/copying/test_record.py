"""Contents of objects that are written back into the same objects."""

from __future__ import annotations

import collections
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flatland.copying.kinds import UncopyableError
from flatland.copying.record import SavedObjects


class Derived(list[Any]):
    """A list with attributes."""

    name = ""


class Holder:
    """An object with attributes."""

    def __init__(self, parts: tuple[Any, ...], array: Any) -> None:
        self.parts = parts
        self.array = array


def test_the_same_objects_get_their_contents_back() -> None:
    derived = Derived([1])
    derived.name = "a"
    ordered = collections.OrderedDict([("b", 1), ("a", 2)])
    array, generator = np.zeros(3), random.Random(1)
    view = array[1:]
    holder: Any = Holder((derived, ordered, {1}, bytearray(2)), array)
    saved = SavedObjects([{"holder": [holder, generator]}], {})
    first = generator.random()
    for _ in range(2):
        derived.append(2)
        del derived.name
        ordered.move_to_end("b")
        view[0] = 5.0
        holder.parts[2].add(3)
        holder.parts[3][0] = 1
        holder.parts = ()
        holder.array = None
        assert saved.write_back() is None
        assert holder.parts == ([1], {"b": 1, "a": 2}, {1}, bytearray(2))
        assert holder.parts[0] is derived
        assert derived.name == "a"
        assert list(ordered) == ["b", "a"]
        assert holder.array is array
        assert view[0] == 0.0
        assert generator.random() == first


def test_excluded_objects_and_connections_are_not_saved() -> None:
    excluded: list[int] = []
    with Path(__file__).open() as stream:
        saved = SavedObjects([{"a": excluded, "b": stream}], {}, [excluded])
    excluded.append(1)
    saved.write_back()
    assert excluded == [1]
    assert saved.outside == [stream]


def test_an_object_with_a_hidden_state_is_refused() -> None:
    with pytest.raises(UncopyableError, match="an object of type generator"):
        SavedObjects([[(number for number in range(3))]], {})


class Slotted:
    """An object with slots."""

    __slots__ = ("first", "second")


def test_only_contents_that_are_other_objects_are_written() -> None:
    slotted = Slotted()
    slotted.first = 1.0
    holder = Holder((), None)
    queue, counts = collections.deque([1, 2]), collections.Counter("aab")
    parts: list[Any] = [slotted, holder, queue, counts, []]
    saved = SavedObjects([parts], {})
    # Values that are equal are other objects.
    holder.parts, holder.array = [], 0
    slotted.first, slotted.second = True, 2
    queue.rotate()
    counts["c"] += 1
    del counts["a"]
    parts.append(3)
    assert saved.write_back() is None
    assert holder.parts == ()
    assert slotted.first is not True
    assert not hasattr(slotted, "second")
    assert list(queue) == [1, 2]
    assert counts == collections.Counter("aab")
    assert len(parts) == 5
    del slotted.first
    vars(holder)["late"] = 1
    saved.write_back()
    assert slotted.first == 1.0
    assert vars(holder) == {"parts": (), "array": None}
