"""Learned policies as controllers; requires Gymnasium (extra `gym`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from flatland.gym import Observation, Situation
from flatland.scenarios.task import Controller
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2
    from flatland.scenarios.task import Scan, Task

_GOAL_RADIUS = 0.3  # m; observations do not depend on it


def policy_controller(
    act: Callable[[Any], Any],
    *,
    low: tuple[float, float],
    high: tuple[float, float],
    observation: Observation | None = None,
) -> type[Controller]:
    """Returns a controller that follows a policy of an environment of `flatland.gym`.

    Args:
        act: Returns the action of an observation: forward speed and yaw rate, from -1 to 1.
        low: Velocities of the action (-1, -1) in the training [m/s, rad/s].
        high: Velocities of the action (1, 1) [m/s, rad/s].
        observation: The observation of the training; None for that of the environments. The laser
            of the robot must have the same beams as in the training.
    """
    parts = observation or Observation()
    least, most = np.array(low), np.array(high)

    class Policy:
        """Computes the observation, and follows the action of the policy."""

        def __init__(self, task: Task) -> None:
            self._task = task
            self._situation: Situation | None = None

        def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
            """Returns the velocities of the action."""
            s = self._situation
            if s is None:
                s = Situation(1, len(scan.ranges), scan.max_range, least, most)
                self._situation = s
                self._layout = parts.layout(len(scan.ranges))
            s.ranges[0] = scan.ranges
            s.poses[0] = pose
            s.velocities[0] = self._task.robot.bodies[0].velocity
            s.goals[0] = goal
            s.locate(_GOAL_RADIUS)
            numbers = np.zeros((1, self._layout.size), np.float32)
            self._layout.write(s, numbers)
            action = np.clip(np.asarray(act(self._layout.present(numbers[0])), float), -1.0, 1.0)
            s.actions[0] = action
            v, omega = (least + (action + 1.0) * (0.5 * (most - least))).tolist()
            return Twist(linear_x=v, angular_z=omega)

    return Policy
