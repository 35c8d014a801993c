"""Actions: numbers from -1 to 1 that are scaled to velocity commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np
from gymnasium import spaces
from gymnasium.error import InvalidAction

from flatland.geometry import DoubleArray, FloatArray

if TYPE_CHECKING:
    from flatland.gym.agents import Agent

A = TypeVar("A", DoubleArray, FloatArray)

DEFAULT_SPEED: Final = 1.0  # m/s, for a drive without a limit
DEFAULT_YAW_RATE: Final = 2.0  # rad/s


class VelocityAction:
    """Two numbers from -1 to 1: forward speed and yaw rate.

    -1 is the lowest and 1 the highest speed; -1 turns to the right and 1 to the left at the highest
    yaw rate. Numbers beyond the bounds are limited to them.
    """

    def __init__(
        self, speed: tuple[float, float] | None = None, yaw_rate: float | None = None
    ) -> None:
        """Creates the action.

        Args:
            speed: Lowest and highest forward speed [m/s]; None for 0 and the limit of the drive.
            yaw_rate: Highest yaw rate [rad/s]; None for the limit of the drive. For a drive without
                limits, they are 1 m/s and 2 rad/s.

        Raises:
            ValueError: A number is out of range.
        """
        if speed is not None and not (np.isfinite(speed).all() and speed[0] < speed[1]):
            raise ValueError(f"speed must be the lowest and the highest speed [m/s], got {speed}")
        if yaw_rate is not None and not (np.isfinite(yaw_rate) and yaw_rate > 0):
            raise ValueError(f"yaw_rate must be positive [rad/s], got {yaw_rate}")
        self.speed = speed
        self.yaw_rate = yaw_rate

    @property
    def space(self) -> spaces.Box:
        """The space of one action."""
        return spaces.Box(-1.0, 1.0, (2,), np.float32)

    def bounds(self, agent: Agent) -> tuple[DoubleArray, DoubleArray]:
        """Returns the commands (v, omega) of the actions (-1, -1) and (1, 1), shape (2,) each."""
        slowest, fastest = self.speed or (0.0, agent.max_speed or DEFAULT_SPEED)
        turn = self.yaw_rate or agent.max_yaw_rate or DEFAULT_YAW_RATE
        return np.array([slowest, -turn]), np.array([fastest, turn])


def checked_actions(actions: object, n: int | None) -> DoubleArray:
    """Returns actions within their bounds as an array.

    Args:
        actions: One action, or one for each agent.
        n: Number of agents; None for one action.

    Returns:
        The actions, each number limited to [-1, 1], shape (n, 2), or (1, 2) for one action.

    Raises:
        InvalidAction: The actions have another shape, or are not numbers, or are NaN.
    """
    shape = (2,) if n is None else (n, 2)
    try:
        given = np.asarray(actions)
    except ValueError as error:  # rows of different lengths
        raise InvalidAction(f"actions must be numbers of shape {shape}, got {actions!r}") from error
    # A conversion would read strings, and drop the imaginary part of complex numbers.
    if given.dtype.kind not in "fiub":
        raise InvalidAction(f"actions must be numbers of shape {shape}, got {actions!r}")
    array = given.astype(np.float64)
    if array.shape != shape:
        raise InvalidAction(f"actions must have the shape {shape}, got {array.shape}")
    if np.isnan(array).any():
        raise InvalidAction(f"actions must not be NaN, got {_first_nan(array)}")
    return limit_to_unit(array).reshape(-1, 2)


def limit_to_unit(numbers: A) -> A:
    """Limits numbers to [-1, 1] in place, and returns them; faster than `numpy.clip`."""
    np.maximum(numbers, -1.0, out=numbers)
    np.minimum(numbers, 1.0, out=numbers)
    return numbers


def _first_nan(array: DoubleArray) -> str:
    if array.ndim == 1:
        return str(array.tolist())
    row = int(np.isnan(array).any(axis=1).argmax())
    return f"{array[row].tolist()} for agent {row}"
