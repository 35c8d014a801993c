"""The interface of controllers, and how all of them turn and brake."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Final

import numpy as np

from flatland.geometry import BoolArray, DoubleArray

DECELERATION: Final = 1.0
"""Deceleration with which controllers expect robots to brake [m/s²]."""
TURN_TIME: Final = 0.2
"""Default time in which a robot would turn to its heading [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Perception:
    """What n robots perceive, in their own frames; row i of each array is robot i.

    Attributes:
        points: Ends of the beams [m], shape (n, beams, 2).
        is_hit: Whether there is an obstacle at the end of each beam, shape (n, beams).
        goals: Positions (ahead, left) of the goals [m], shape (n, 2).
        max_range: Range of the lasers [m].
        velocities: Forward speed and yaw rate [m/s, rad/s], shape (n, 2); None if they are not
            known.
    """

    points: DoubleArray
    is_hit: BoolArray
    goals: DoubleArray
    max_range: float
    velocities: DoubleArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Capabilities:
    """What a controller needs to know about a robot.

    Attributes:
        radius: Radius of the disc that contains the robot [m].
        low: Lowest velocity command (v, omega) [m/s, rad/s], shape (2,).
        high: Highest velocity command, shape (2,).
        period: Time between two commands [s].
    """

    radius: float
    low: DoubleArray
    high: DoubleArray
    period: float


class Controller(ABC):
    """Chooses velocities from perceptions, without a memory.

    Attributes:
        robot: The capabilities of the robots.
    """

    def __init__(self, robot: Capabilities) -> None:
        """Creates a controller of any number of equal robots."""
        self.robot = robot

    @abstractmethod
    def choose(self, perception: Perception) -> DoubleArray:
        """Returns the velocity commands (v, omega) of all robots [m/s, rad/s], shape (n, 2)."""

    def towards(
        self, headings: DoubleArray, free: DoubleArray, turn_time: float = TURN_TIME
    ) -> DoubleArray:
        """Returns commands that turn to headings and then drive.

        Args:
            headings: Wanted headings in the frame of the robot [rad], shape (n,).
            free: Distances that are free on the way [m], shape (n,).
            turn_time: Time in which a robot would turn to its heading [s].
        """
        low, high, period = self.robot.low, self.robot.high, self.robot.period
        turn = np.clip(headings / turn_time, low[1], high[1])
        # The speed from which the robot can brake after this command.
        change = DECELERATION * period
        speed = np.sqrt(change * change + 2.0 * DECELERATION * np.maximum(free, 0.0)) - change
        # On a curve, the robot leaves the line that is free.
        speed = np.minimum(speed, high[0]) * np.maximum(np.cos(headings), 0.0) ** 4
        return np.stack((np.maximum(speed, low[0]), turn), axis=1)


def check_positive(name: str, value: float) -> None:
    """Checks an option of a controller.

    Raises:
        ValueError: It is not positive and finite.
    """
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} must be positive, got {value}")
