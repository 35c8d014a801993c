"""A path on the true map that controllers follow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.scenarios.planner import PlanningError, plan_path

if TYPE_CHECKING:
    from flatland.geometry import DoubleArray, Pose, Vector2
    from flatland.scenarios.task import Task


class Guide:
    """Plans a path for each goal, and again when the robot is far from it or there was no path."""

    _MAX_DEVIATION: Final = 1.0  # from the path, above which it plans again [m]
    _RETRY: Final = 1.0  # time after which it plans again if there is no path [s]

    def __init__(self, task: Task, *, only_walls: bool) -> None:
        """Plans the path to the first goal.

        Args:
            task: The task of the controller.
            only_walls: Whether the map contains only walls and static models, and not the other
                models where they are when the path is planned.
        """
        self._task = task
        self._only_walls = only_walls
        self._goal: Vector2 | None = None
        self._path: DoubleArray | None = None
        self._next = 0  # index of the point of the path that was closest
        self._planned_at = 0.0
        self._plan(task.robot.pose, task.goals[0])

    def target(self, pose: Pose, goal: Vector2, lookahead: float) -> Vector2 | None:
        """Returns the point of the path that is a distance ahead, None if there is no path.

        Args:
            pose: Pose of the robot [m, rad].
            goal: The current goal [m].
            lookahead: The distance from the robot [m].
        """
        if goal != self._goal or self._must_plan_again(pose):
            self._plan(pose, goal)
        if self._path is None:
            return None
        distances = np.hypot(*(self._path - pose[:2]).T)
        # Only a short part ahead: the path may return to the same place.
        self._next += int(np.argmin(distances[self._next : self._next + 20]))
        far = np.flatnonzero(distances[self._next :] >= lookahead)
        x, y = (self._path[self._next + far[0]] if len(far) else self._path[-1]).tolist()
        return (x, y)

    def plan_again(self) -> None:
        """Makes the next call of `target` plan a new path, for example after a recovery."""
        self._goal = None

    def _must_plan_again(self, pose: Pose) -> bool:
        if self._path is None:
            return self._task.world.time - self._planned_at >= self._RETRY
        return float(np.hypot(*(self._path - pose[:2]).T).min()) > self._MAX_DEVIATION

    def _plan(self, pose: Pose, goal: Vector2) -> None:
        self._goal = goal
        self._planned_at = self._task.world.time
        self._next = 0
        try:
            self._path = plan_path(self._task, pose[:2], goal, only_walls=self._only_walls)
        except PlanningError:
            self._path = None
