"""The interface of controllers.

A controller is a class with two methods:

- `__init__(self, task)`, called once per run with a `Task`. Its world and robot are views
  (`flatland.scenarios.views`), by which a controller can query them, for example to plan a path,
  but cannot change them: an attempt raises a `ViewError`, and the run is an error.
- `command(self, scan, pose, goal)`, called once per period with the current `Scan`, the true pose
  (x, y, theta) of the robot and the current goal (x, y), both in the world frame [m, rad]. It
  returns a `flatland.Twist`: linear_x and linear_y [m/s] and angular_z [rad/s] of the robot.

A controller that recovers from a situation in which it was stuck counts that in an attribute
`recoveries`. A function `command(scan, pose, goal)` is a controller as well.

A run must depend only on its seed: random numbers come from `task.rng`, and classes have no state
that survives a run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np

    from flatland.geometry import DoubleArray, Pose, Vector2
    from flatland.scenarios.views import ModelView, WorldView
    from flatland.values import Twist


@dataclass(frozen=True, slots=True)
class Task:
    """What a controller has to do, and with which robot.

    Attributes:
        world: The world, for queries.
        robot: The model to be driven, for queries.
        radius: Radius of the circle about the origin of the robot that contains it [m].
        category_bits: Categories of the obstacles that the robot collides with.
        goals: Goals (x, y) in the world frame [m].
        period: Time between two commands [s].
        max_speed: Limit of the speed [m/s]; commands above it are reduced.
        max_turn: Limit of the yaw rate [rad/s].
        rng: Random numbers that derive from the seed of the run.
    """

    world: WorldView
    robot: ModelView
    radius: float
    category_bits: int
    goals: tuple[Vector2, ...]
    period: float
    max_speed: float
    max_turn: float
    rng: np.random.Generator


@dataclass(frozen=True, slots=True)
class Scan:
    """A laser scan, with the noise of the laser.

    Attributes:
        ranges: Range of each beam [m], shape (n,); `max_range` for a beam without a hit, 0 for a
            hit that is too close.
        max_range: Length of a beam [m].
        points: Hits in the frame of the robot [m], shape (k, 2).
    """

    ranges: DoubleArray
    max_range: float
    points: DoubleArray


class Controller(Protocol):
    """A controller; see the description of the module."""

    def __init__(self, task: Task) -> None:
        """Prepares a run."""

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Returns the velocities until the next call."""
