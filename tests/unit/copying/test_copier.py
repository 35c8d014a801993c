"""Copies of objects that refer to each other."""

from __future__ import annotations

import collections
import functools
from typing import Any

import pytest

from flatland.copying.copier import Copier
from flatland.copying.kinds import UncopyableError


class Node:
    """Has a hash that depends on an attribute."""

    def __init__(self, name: str, other: object = None) -> None:
        self.other = other
        self.name = name

    def __hash__(self) -> int:
        return hash(self.name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Node) and other.name == self.name


def copied(obj: Any, copier: Copier | None = None) -> Any:
    copier = copier or Copier({})
    copy = copier(obj)
    copier.finish()
    return copy


def test_hashed_items_are_complete_when_they_are_hashed() -> None:
    owner = Node("owner")
    owner.other = (frozenset([Node("a", owner)]), {Node("b", owner)}, {Node("c", owner): 1})
    copy = copied(owner)
    for container, name in zip(copy.other, "abc", strict=True):
        assert Node(name) in container
        (item,) = container
        assert item.other is copy


def test_a_long_chain_of_objects_is_copied() -> None:
    chain: Any = None
    for number in range(3_000):
        chain = Node(str(number), [chain])
    copy, count = copied(chain), 0
    while copy is not None:
        (copy,) = copy.other
        count += 1
    assert count == 3_000


def test_immutable_objects_are_shared_and_others_are_not() -> None:
    items: list[int] = [1]
    value = ("a", 1, frozenset([2]), functools.partial(max, 3))
    shared = copied((value, items, items))
    assert shared[0] is value
    assert shared[1] is shared[2]
    assert shared[1] == items
    assert shared[1] is not items


def test_partial_functions_refer_to_copies() -> None:
    items: list[int] = []
    partial, copy = copied((functools.partial(functools.partial(list.append, items), 1), items))
    partial()
    assert (copy, items) == ([1], [])


@pytest.mark.parametrize(
    "value",
    [
        collections.OrderedDict([("b", [1]), ("a", [2])]),
        collections.defaultdict(list, a=[1]),
        collections.Counter("abca"),
        collections.deque([[1], [2]], maxlen=2),
    ],
)
def test_containers_of_the_standard_library_are_copied(value: Any) -> None:
    copy = copied(value)
    assert type(copy) is type(value)
    assert copy == value
    assert list(copy) == list(value)
    assert repr(copy) == repr(value)


def test_an_object_with_a_hidden_state_is_refused() -> None:
    with pytest.raises(UncopyableError, match="an object of type generator"):
        copied([(number for number in range(3))])
