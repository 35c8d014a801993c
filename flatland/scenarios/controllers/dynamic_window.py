"""A controller that follows a path on the map by a dynamic window."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from flatland import controllers
from flatland.scenarios.controllers.guide import Guide
from flatland.scenarios.controllers.reactive import capabilities_of, perceive, twist_of
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2
    from flatland.scenarios.task import Scan, Task


class DynamicWindow:
    """Drives to a point ahead on a path that is planned on the map of the walls.

    As in navigation stacks, everything that is not on the map is only in the scan. A robot that
    does not move for some time turns on the spot and plans a new path, which counts as a recovery.

    Attributes:
        recoveries: Number of times that it began to turn on the spot.
    """

    _LOOKAHEAD: Final = 1.0  # distance of the point on the path [m]
    _PATIENCE: Final = 1.0  # time without motion until a recovery [s]
    _RECOVERY: Final = 1.0  # duration of the turn on the spot [s]

    def __init__(self, task: Task) -> None:
        """Plans the path to the first goal."""
        self._controller = controllers.DynamicWindow(capabilities_of(task))
        self._last = Twist()
        self._task = task
        self._guide = Guide(task, only_walls=True)
        self._blocked_for = 0.0
        self._turns_until = -math.inf
        self._side = 1.0
        self.recoveries = 0

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Returns the velocities towards the point ahead."""
        target = self._guide.target(pose, goal, self._LOOKAHEAD) or goal
        now = self._task.world.time
        if now < self._turns_until:
            self._last = Twist(angular_z=self._side * 0.6 * self._task.max_turn)
            return self._last
        self._last = twist_of(self._controller.choose(perceive(scan, pose, target, self._last)))
        is_blocked = self._last.linear_x < 0.05
        self._blocked_for = self._blocked_for + self._task.period if is_blocked else 0.0
        if self._blocked_for > self._PATIENCE:
            self._blocked_for = 0.0
            self._turns_until = now + self._RECOVERY
            self.recoveries += 1
            self._guide.plan_again()
            bearing = math.atan2(target[1] - pose[1], target[0] - pose[0]) - pose[2]
            self._side = math.copysign(1.0, math.remainder(bearing, math.tau))
        return self._last
