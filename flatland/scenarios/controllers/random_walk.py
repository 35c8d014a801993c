"""A controller that drives at random."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2
    from flatland.scenarios.task import Scan, Task


class RandomWalk:
    """Drives with random velocities, each for a second: a lower bound for all other controllers."""

    _HOLD: Final = 1.0  # time between two changes [s]

    def __init__(self, task: Task) -> None:
        """Starts at rest."""
        self._task = task
        self._twist = Twist()
        self._left = 0.0  # time until the next change [s]

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:  # noqa: ARG002
        """Returns the current velocities."""
        if self._left <= 0:
            turn = self._task.rng.uniform(-self._task.max_turn, self._task.max_turn)
            self._twist = Twist(
                linear_x=self._task.rng.uniform(0, self._task.max_speed), angular_z=turn
            )
            self._left = self._HOLD
        self._left -= self._task.period
        return self._twist
