"""Markers of people for RViz."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from flatland.values import PeopleMarkers, PeopleStates

if TYPE_CHECKING:
    from flatland.plugins._people_config import Group


def fields_of(states: PeopleStates) -> dict[str, Any]:
    """Returns the fields of states by name, as arguments of a derived class."""
    return {field.name: getattr(states, field.name) for field in dataclasses.fields(states)}


class MarkerSource:
    """Converts states to markers: adds the appearance of groups, and who was removed."""

    # The markers that were emitted are not part of the simulation.
    outside_state: ClassVar[dict[str, Callable[[], object]]] = {"_last": lambda: None}

    def __init__(self, groups: Sequence[Group]) -> None:
        """Creates a source without previous markers."""
        self._names = tuple(group.name for group in groups)
        self._colors = tuple(tuple(group.color) for group in groups)
        self._radii = tuple(group.radius for group in groups)
        self._last: set[int] | None = None

    def make(self, states: PeopleStates, body_ids: Sequence[int]) -> PeopleMarkers:
        """Returns the markers of people.

        Args:
            states: The people.
            body_ids: Id of the body of each person.
        """
        ids = tuple(body_id & 0x7FFFFFFF for body_id in body_ids)  # without the generation
        last, self._last = self._last, set(ids)
        return PeopleMarkers(
            **fields_of(states),
            ids=ids,
            group_names=self._names,
            colors=self._colors,
            radii=self._radii,
            removed=None if last is None else tuple(sorted(last - self._last)),
        )
