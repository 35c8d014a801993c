"""Endings: conditions that terminate an episode."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from flatland.geometry import BoolArray

if TYPE_CHECKING:
    from flatland.gym.situation import Situation


class Ending(ABC):
    """A condition under which the episode of an agent terminates; `|` combines conditions.

    The time limit of an episode is not an ending: it truncates the episode.
    """

    @abstractmethod
    def check(self, situation: Situation) -> BoolArray:
        """Returns whether the episode of each agent terminates, shape (n,)."""

    def __or__(self, other: Ending) -> Ending:
        """Returns the condition that at least one of two is met."""
        return AnyOf(self, other)


class AnyOf(Ending):
    """At least one of several conditions."""

    def __init__(self, *endings: Ending) -> None:
        """Creates the condition."""
        self.endings = endings

    def check(self, situation: Situation) -> BoolArray:
        """Returns whether any of the conditions is met."""
        ended = np.zeros(len(situation), np.bool_)
        for ending in self.endings:
            ended |= ending.check(situation)
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
        if not distance > 0:
            raise ValueError(f"distance must be positive [m], got {distance}")
        self.distance = distance

    def check(self, situation: Situation) -> BoolArray:
        """Returns where the goal is too far away."""
        ended: BoolArray = situation.distance > self.distance
        return ended


def navigation_ending() -> Ending:
    """Returns the default: the agent has arrived, or touched something."""
    return Arrived() | Collided()
