"""A controller that follows a path on the true map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from flatland.scenarios.controllers.guide import Guide
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2
    from flatland.scenarios.task import Scan, Task


class PurePursuit:
    """Follows the shortest path on a grid map of all obstacles, as they are when it is planned.

    It uses the exact map and pose instead of the scan: an upper bound for other controllers.
    """

    _LOOKAHEAD: Final = 0.35  # [m]
    _SLOW_DOWN: Final = 0.8  # distance to the goal below which it slows down [m]
    _TURN: Final = math.radians(30)  # deviation above which it turns on the spot

    def __init__(self, task: Task) -> None:
        """Plans the path to the first goal."""
        self._task = task
        self._guide = Guide(task, only_walls=False)

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:  # noqa: ARG002
        """Steers towards a point on the path ahead, and waits while there is no path."""
        target = self._guide.target(pose, goal, self._LOOKAHEAD)
        if target is None:
            return Twist()
        dx, dy = target[0] - pose[0], target[1] - pose[1]
        distance = max(math.hypot(dx, dy), 1e-6)
        bearing = math.remainder(math.atan2(dy, dx) - pose[2], math.tau)
        if abs(bearing) > self._TURN:
            return Twist(angular_z=math.copysign(self._task.max_turn, bearing))
        left = math.hypot(goal[0] - pose[0], goal[1] - pose[1])
        speed = self._task.max_speed * min(1.0, left / self._SLOW_DOWN) * math.cos(bearing)
        curvature = 2 * math.sin(bearing) / distance
        # On a narrow curve, the speed follows from the limit of the yaw rate.
        if abs(curvature) * speed > self._task.max_turn:
            speed = self._task.max_turn / abs(curvature)
        return Twist(linear_x=speed, angular_z=curvature * speed)
