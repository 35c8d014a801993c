"""Rewards: terms that are added up and scaled."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.geometry import DoubleArray

if TYPE_CHECKING:
    from flatland.gym.situation import Situation


class Reward(ABC):
    """A reward of all agents; `+` and `*` combine rewards."""

    @abstractmethod
    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the reward of each agent for the last step, shape (n,)."""

    def __add__(self, other: Reward) -> Reward:
        """Returns the sum of two rewards."""
        return Sum(self, other)

    def __mul__(self, factor: float) -> Reward:
        """Returns the reward multiplied by a number."""
        return Scaled(self, factor)

    __rmul__ = __mul__


class Sum(Reward):
    """The sum of rewards."""

    def __init__(self, *terms: Reward) -> None:
        """Creates the sum; nested sums are merged."""
        self.terms: tuple[Reward, ...] = ()
        for term in terms:
            self.terms += term.terms if isinstance(term, Sum) else (term,)

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the sum of the terms, in their order."""
        weights = [weight for weight in map(_weight, self.terms) if weight is not None]
        if len(weights) == len(self.terms):
            return situation.core.rewards(weights)
        total = np.zeros(len(situation))
        for term in self.terms:
            total += term.compute(situation)
        return total


class Scaled(Reward):
    """A reward multiplied by a number."""

    def __init__(self, reward: Reward, factor: float) -> None:
        """Creates the product."""
        self.reward = reward
        self.factor = float(factor)

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the product."""
        return self.reward.compute(situation) * self.factor


class Progress(Reward):
    """How much closer to the goal the agent is than before the step [m]."""

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the difference of the distances."""
        return situation.previous_distance - situation.distance


class Arrival(Reward):
    """1 for a step in which the agent arrives at its goal."""

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns 1 where the agent has arrived."""
        return np.asarray(situation.arrived, np.float64)


class Contact(Reward):
    """1 for a step in which the agent touches anything; to be scaled by a negative number."""

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns 1 where the agent collided."""
        return np.asarray(situation.collided, np.float64)


class Step(Reward):
    """1 for each step; to be scaled by a negative number, which favours short paths."""

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns 1 for all agents."""
        return np.ones(len(situation))


class Jerkiness(Reward):
    """The squared change of the action; to be scaled by a negative number."""

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the sum of the squared changes of all numbers."""
        change = situation.actions - situation.previous_actions
        return np.asarray((change * change).sum(axis=1))


class Proximity(Reward):
    """How close the nearest obstacle is: 0 beyond a distance, 1 at the sensor.

    To be scaled by a negative number.
    """

    def __init__(self, distance: float = 0.5) -> None:
        """Creates the reward.

        Args:
            distance: Distance from the sensor beyond which obstacles do not count [m].

        Raises:
            ValueError: `distance` is not positive.
        """
        if not distance > 0:
            raise ValueError(f"distance must be positive [m], got {distance}")
        self.distance = distance

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the proximity of the nearest range of each scan."""
        nearest = np.fmin.reduce(situation.ranges, axis=1).astype(np.float64)
        # Without any hit, the nearest range may be NaN.
        near = np.fmin(np.maximum(nearest, 0.0), self.distance)
        return np.asarray(1.0 - near / self.distance)


# Their numbers in the core. A subclass may compute something else.
_IN_CORE: Final[dict[type[Reward], int]] = {Progress: 0, Arrival: 1, Contact: 2, Step: 3}


def _weight(term: Reward) -> tuple[int, float] | None:
    """Returns the number and the factor of a term that the core computes, None for others."""
    factor = 1.0
    if type(term) is Scaled:
        factor, term = term.factor, term.reward
    number = _IN_CORE.get(type(term))
    return None if number is None else (number, factor)


def navigation_reward() -> Reward:
    """Returns the default reward: progress, an arrival and no contacts, in little time."""
    return Progress() + 5.0 * Arrival() + -5.0 * Contact() + -0.02 * Step()
