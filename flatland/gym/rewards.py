"""Rewards: terms that are added up and scaled."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from flatland.checks import checked_finite, checked_positive, shown
from flatland.geometry import DoubleArray

if TYPE_CHECKING:
    from flatland.gym.situation import Situation


RewardFunction = Callable[["Situation"], npt.ArrayLike]
"""Returns the reward of each agent for the last step, shape (n,), finite."""


class Reward(ABC):
    """A reward of all agents; `+` and `*` combine rewards, also with functions.

    A custom reward is a subclass, or a function that is called as `compute`. What it returns is
    checked in each step.
    """

    @abstractmethod
    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the reward of each agent for the last step, shape (n,), finite."""

    def __add__(self, other: Reward | RewardFunction) -> Reward:
        """Returns the sum of two rewards."""
        return Sum(self, other)

    def __radd__(self, other: RewardFunction) -> Reward:
        """Returns the sum of a function and the reward."""
        return Sum(other, self)

    def __mul__(self, factor: float) -> Reward:
        """Returns the reward multiplied by a number."""
        return Scaled(self, factor)

    __rmul__ = __mul__


class FunctionReward(Reward):
    """A reward that a function computes."""

    def __init__(self, function: RewardFunction) -> None:
        """Stores the function."""
        self.function = function

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns what the function returns."""
        return self.function(situation)  # type: ignore[return-value]  # checked by `rewards_of`


def as_reward(name: str, reward: Reward | RewardFunction) -> Reward:
    """Returns a reward, which may be given as a function.

    Args:
        name: Name of the argument, for the error.
        reward: The reward.

    Raises:
        TypeError: It is neither.
    """
    if isinstance(reward, Reward):
        return reward
    if callable(reward) and not isinstance(reward, type):
        return FunctionReward(reward)
    raise TypeError(f"{name} must be a Reward or a function of a Situation, got {shown(reward)}")


def rewards_of(reward: Reward, situation: Situation) -> DoubleArray:
    """Returns the reward of each agent for the last step, shape (n,).

    Raises:
        TypeError: A custom reward returned no numbers.
        ValueError: A custom reward returned an array of another shape, NaN or infinite numbers.
    """
    values = reward.compute(situation)
    if type(reward) in _INCLUDED:
        return values
    return checked_rows(_name_of(reward), values, len(situation), "fiub", np.float64)


def checked_rows(
    name: str, values: object, n: int, kinds: str, dtype: npt.DTypeLike
) -> npt.NDArray[Any]:
    """Returns a copy of what a custom reward or ending returned for n agents.

    Args:
        name: Name of the reward or the ending, for the error.
        values: What it returned.
        n: Number of agents.
        kinds: Permitted kinds of types of numpy.
        dtype: Type of the copy.

    Raises:
        TypeError: The values have another type.
        ValueError: They have another shape than (n,), or are NaN or infinite.
    """
    what = "bools" if kinds == "b" else "finite numbers"
    array = np.asarray(values)
    if array.dtype.kind not in kinds:
        raise TypeError(f"{name} must return {what} of the shape ({n},), got {shown(values)}")
    if array.shape != (n,):
        raise ValueError(f"{name} must return an array of the shape ({n},), got {array.shape}")
    if not np.isfinite(array).all():
        row = int((~np.isfinite(array)).argmax())
        raise ValueError(f"{name} must return finite numbers, got {array[row]} for agent {row}")
    return np.array(array, dtype)


def _name_of(reward: Reward) -> str:
    if isinstance(reward, FunctionReward):
        function = reward.function
        return f"the reward {getattr(function, '__qualname__', type(function).__qualname__)}"
    return f"the reward {type(reward).__qualname__}"


class Sum(Reward):
    """The sum of rewards."""

    def __init__(self, *terms: Reward | RewardFunction) -> None:
        """Creates the sum; nested sums are merged.

        Raises:
            TypeError: A term is neither a reward nor a function.
        """
        self.terms: tuple[Reward, ...] = ()
        for given in terms:
            term = as_reward("each term of a reward", given)
            self.terms += term.terms if isinstance(term, Sum) else (term,)

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the sum of the terms, in their order."""
        weights = [weight for weight in map(_weight, self.terms) if weight is not None]
        if len(weights) == len(self.terms):
            return situation.core.rewards(weights)
        total = np.zeros(len(situation))
        for term in self.terms:
            total += rewards_of(term, situation)
        return total


class Scaled(Reward):
    """A reward multiplied by a number."""

    def __init__(self, reward: Reward, factor: float) -> None:
        """Creates the product.

        Raises:
            ValueError: The factor is no finite number.
        """
        self.reward = reward
        self.factor = checked_finite("the factor of a reward", factor)

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the product."""
        return rewards_of(self.reward, situation) * self.factor


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
        self.distance = checked_positive("distance", distance, "m")

    def compute(self, situation: Situation) -> DoubleArray:
        """Returns the proximity of the nearest range of each scan."""
        nearest = np.fmin.reduce(situation.ranges, axis=1).astype(np.float64)
        # Without any hit, the nearest range may be NaN.
        near = np.fmin(np.maximum(nearest, 0.0), self.distance)
        return np.asarray(1.0 - near / self.distance)


# A subclass may compute something else.
_INCLUDED: Final = frozenset({Sum, Scaled, Progress, Arrival, Contact, Step, Jerkiness, Proximity})
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
