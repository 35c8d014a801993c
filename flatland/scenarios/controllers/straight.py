"""A controller that drives straight to the goal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from flatland.geometry import wrap_angle
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2
    from flatland.scenarios.task import Scan, Task


class Straight:
    """Turns towards the goal and drives straight ahead, without regard to obstacles."""

    _GAIN: Final = 2.0  # yaw rate relative to the bearing [1/s]
    _SLOW_DOWN: Final = 0.8  # distance to the goal below which it slows down [m]

    def __init__(self, task: Task) -> None:
        """Keeps the limits of the robot."""
        self._task = task

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:  # noqa: ARG002
        """Steers towards the goal."""
        dx, dy = goal[0] - pose[0], goal[1] - pose[1]
        bearing = wrap_angle(math.atan2(dy, dx) - pose[2])
        speed = self._task.max_speed * min(1.0, math.hypot(dx, dy) / self._SLOW_DOWN)
        return Twist(linear_x=speed * max(0.0, math.cos(bearing)), angular_z=self._GAIN * bearing)
