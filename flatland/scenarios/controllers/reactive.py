"""The controllers of `flatland.controllers` for the robot of a task."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland import controllers
from flatland.controllers import Capabilities, Perception
from flatland.geometry import invert, transform_points
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import DoubleArray, Pose, Vector2
    from flatland.scenarios.task import Scan, Task


def capabilities_of(task: Task) -> Capabilities:
    """Returns what a controller needs to know about the robot of a task."""
    limits = np.array((task.max_speed, task.max_turn))
    return Capabilities(task.radius, np.array((0.0, -task.max_turn)), limits, task.period)


def perceive(scan: Scan, pose: Pose, goal: Vector2, last: Twist | None = None) -> Perception:
    """Returns what the robot perceives.

    Args:
        scan: The scan.
        pose: Pose of the robot, world frame [m, rad].
        goal: The goal, world frame [m].
        last: The last command, which the robot follows; None if it is not required.
    """
    return Perception(
        scan.points[np.newaxis],
        np.ones((1, len(scan.points)), np.bool_),
        transform_points(invert(pose), np.array([goal])),
        scan.max_range,
        None if last is None else np.array([(last.linear_x, last.angular_z)]),
    )


def twist_of(commands: DoubleArray) -> Twist:
    """Returns the command of the only robot, shape (1, 2)."""
    ((speed, turn),) = commands.tolist()
    return Twist(linear_x=speed, angular_z=turn)


class Straight:
    """Turns to the goal and drives straight ahead, without regard for obstacles."""

    def __init__(self, task: Task) -> None:
        """Keeps the limits of the robot."""
        self._controller = controllers.Straight(capabilities_of(task))

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Steers towards the goal."""
        return twist_of(self._controller.choose(perceive(scan, pose, goal)))


class Gap:
    """Drives along the free direction that is closest to those of the goal and of before.

    It has no map: dead ends on the way to the goal trap it.
    """

    # Longer distances exclude doors and bends of corridors.
    _DISTANCE: Final = 1.0  # that is to be free [m]
    _MARGIN: Final = 0.1  # distance to obstacles [m]

    def __init__(self, task: Task) -> None:
        """Starts without a preferred direction."""
        self._controller = controllers.Gap(
            capabilities_of(task),
            distance=self._DISTANCE,
            margin=self._MARGIN,
        )
        self._heading = math.nan  # last direction in the world frame [rad]

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Chooses a free direction, and a speed at which the robot can still stop."""
        before = np.array([self._heading - pose[2]])
        headings, free = self._controller.best(perceive(scan, pose, goal), before)
        self._heading = pose[2] + headings.item()
        return twist_of(self._controller.commands(headings, free))
