"""Endings: conditions that terminate an episode."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from flatland.checks import checked_positive, shown
from flatland.geometry import BoolArray
from flatland.gym.rewards import checked_rows

if TYPE_CHECKING:
    from flatland.gym.situation import Situation


EndingFunction = Callable[["Situation"], npt.ArrayLike]
"""Returns whether the episode of each agent terminates, bools of shape (n,)."""


class Ending(ABC):
    """A condition under which the episode of an agent terminates; `|` combines conditions.

    A custom ending is a subclass, or a function that is called as `check`. The time limit of an
    episode is not an ending: it truncates the episode.
    """

    @abstractmethod
    def check(self, situation: Situation) -> BoolArray:
        """Returns whether the episode of each agent terminates, bools of shape (n,)."""

    def __or__(self, other: Ending | EndingFunction) -> Ending:
        """Returns the condition that at least one of two is met."""
        return AnyOf(self, other)

    def __ror__(self, other: EndingFunction) -> Ending:
        """Returns the condition that a function or the ending is met."""
        return AnyOf(other, self)


class FunctionEnding(Ending):
    """An ending that a function determines."""

    def __init__(self, function: EndingFunction) -> None:
        """Stores the function."""
        self.function = function

    def check(self, situation: Situation) -> BoolArray:
        """Returns what the function returns."""
        return self.function(situation)  # type: ignore[return-value]  # checked by `endings_of`


def as_ending(name: str, ending: Ending | EndingFunction) -> Ending:
    """Returns an ending, which may be given as a function.

    Args:
        name: Name of the argument, for the error.
        ending: The ending.

    Raises:
        TypeError: It is neither.
    """
    if isinstance(ending, Ending):
        return ending
    if callable(ending) and not isinstance(ending, type):
        return FunctionEnding(ending)
    raise TypeError(f"{name} must be an Ending or a function of a Situation, got {shown(ending)}")


def endings_of(ending: Ending, situation: Situation) -> BoolArray:
    """Returns whether the episode of each agent terminates, shape (n,).

    Raises:
        TypeError: A custom ending returned no bools.
        ValueError: A custom ending returned an array of another shape.
    """
    ended = ending.check(situation)
    if type(ending) in _INCLUDED:
        return ended
    name = type(ending).__qualname__
    if isinstance(ending, FunctionEnding):
        name = getattr(ending.function, "__qualname__", type(ending.function).__qualname__)
    return checked_rows(f"the ending {name}", ended, len(situation), "b", np.bool_)


class AnyOf(Ending):
    """At least one of several conditions."""

    def __init__(self, *endings: Ending | EndingFunction) -> None:
        """Creates the condition.

        Raises:
            TypeError: One of them is neither an ending nor a function.
        """
        self.endings = tuple(as_ending("each ending", ending) for ending in endings)

    def check(self, situation: Situation) -> BoolArray:
        """Returns whether any of the conditions is met."""
        ended = np.zeros(len(situation), np.bool_)
        for ending in self.endings:
            ended |= endings_of(ending, situation)
        return ended


class Arrived(Ending):
    """The agent is at its goal."""

    def check(self, situation: Situation) -> BoolArray:
        """Returns where the agent has arrived."""
        return situation.arrived.copy()


class Collided(Ending):
    """The agent touched anything during the step."""

    def check(self, situation: Situation) -> BoolArray:
        """Returns where the agent collided."""
        return situation.collided.copy()


class Strayed(Ending):
    """The agent is too far away from its goal."""

    def __init__(self, distance: float) -> None:
        """Creates the condition.

        Args:
            distance: Distance beyond which the episode terminates [m].

        Raises:
            ValueError: `distance` is not positive.
        """
        self.distance = checked_positive("distance", distance, "m")

    def check(self, situation: Situation) -> BoolArray:
        """Returns where the goal is too far away."""
        ended: BoolArray = situation.distance > self.distance
        return ended


# A subclass may determine something else.
_INCLUDED: Final = frozenset({AnyOf, Arrived, Collided, Strayed})


def navigation_ending() -> Ending:
    """Returns the default: the agent has arrived, or touched something."""
    return Arrived() | Collided()
