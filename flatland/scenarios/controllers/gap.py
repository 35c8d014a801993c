"""A controller that drives into the open direction closest to the goal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import DoubleArray, Pose, Vector2
    from flatland.scenarios.task import Scan, Task


class FollowGap:
    """Drives straight towards the goal, or into the open direction that is closest to it.

    It has neither a map nor a memory: dead ends on the way to the goal trap it.
    """

    _MARGIN: Final = 0.1  # distance to the sides of a gap [m]
    _LOOKAHEAD: Final = 2.5  # [m]
    _WIDEST: Final = math.radians(115)  # change of direction, within the view of a usual scanner
    _DIRECTIONS: Final = 93  # candidates, 2.5 degrees apart
    _PERSISTENCE: Final = 0.3  # cost of a change of direction, relative to a deviation
    _DECELERATION: Final = 0.8  # assumed ability of the robot to brake [m/s^2]

    def __init__(self, task: Task) -> None:
        """Starts without a preferred direction."""
        self._task = task
        self._angles = np.linspace(-self._WIDEST, self._WIDEST, self._DIRECTIONS)
        self._units = np.stack((np.cos(self._angles), np.sin(self._angles)))
        self._heading: float | None = None  # last direction in the world frame [rad]

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Chooses an open direction, and a speed at which the robot can still stop."""
        dx, dy = goal[0] - pose[0], goal[1] - pose[1]
        cost = self._deviations(math.atan2(dy, dx) - pose[2])
        if self._heading is not None:
            cost += self._PERSISTENCE * self._deviations(self._heading - pose[2])
        free = self._free_lengths(scan)
        needed = min(math.hypot(dx, dy), self._LOOKAHEAD)
        while not (free >= needed).any():
            needed = needed / 2 if needed > 0.01 else 0.0
        best = int(np.argmin(np.where(free >= needed, cost, np.inf)))
        angle = float(self._angles[best])
        self._heading = pose[2] + angle
        # The free length ahead matters as well, until the robot has turned.
        room = max(0.0, min(float(free[best]), float(free[self._DIRECTIONS // 2])))
        speed = self._task.max_speed * max(0.0, math.cos(1.5 * min(abs(angle), 1.0)))
        return Twist(
            linear_x=min(speed, math.sqrt(2 * self._DECELERATION * room)), angular_z=2.0 * angle
        )

    def _deviations(self, bearing: float) -> DoubleArray:
        """Returns the angles between a direction and all candidates, from 0 to pi [rad]."""
        deviations: DoubleArray = np.abs(
            np.remainder(self._angles - bearing + np.pi, math.tau) - np.pi
        )
        return deviations

    def _free_lengths(self, scan: Scan) -> DoubleArray:
        """Returns the free length of a lane as wide as the robot in each direction [m]."""
        along = scan.points @ self._units
        across = scan.points @ np.stack((-self._units[1], self._units[0]))
        lane = self._task.radius + self._MARGIN
        is_in_lane = (along > 0) & (np.abs(across) < lane)
        nearest = np.where(is_in_lane, along, scan.max_range).min(axis=0, initial=scan.max_range)
        lengths: DoubleArray = np.maximum(nearest - self._task.radius, 0.0)
        return lengths
