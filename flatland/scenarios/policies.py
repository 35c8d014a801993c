"""Learned policies as controllers; requires the extra `gym`, and for ONNX files `onnx`."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flatland.gym import Observation, Situation
from flatland.gym.policies import Policy
from flatland.scenarios.task import Controller
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import DoubleArray, Pose, Vector2
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

    class Learned(_Follower):
        """Follows the policy with the beams of the laser."""

        def __init__(self, task: Task) -> None:
            super().__init__(task, act, least, most, parts, _own_ranges)

    return Learned


def file_controller(file: Path | None) -> Callable[[Task], Controller]:
    """Returns what creates controllers that follow a policy in an ONNX file.

    The laser may differ from that of the training: the hits of its scan become the ranges of the
    beams of the training, of which those without a hit have the greatest range. For a robot of
    another radius, the ranges are changed by the difference. A run whose period is not the
    duration of an action in the training is a `PolicyError`.

    Args:
        file: The file; None for the included policy.

    Raises:
        MissingPackageError: ONNX Runtime is not installed.
        PolicyError: The file is missing or is not a policy.
    """
    Policy(file)  # for its errors
    return functools.partial(_follow_file, file)


def _follow_file(file: Path | None, task: Task) -> Controller:
    policy = Policy(file)  # of its own, because it has a state
    policy.check_period(task.period)
    robot = policy.robot
    view = functools.partial(
        _ranges_of_hits, robot.beams, robot.max_range, task.radius - robot.radius
    )
    return _Follower(task, policy, np.array(robot.low), np.array(robot.high), Observation(), view)


def _own_ranges(scan: Scan) -> tuple[DoubleArray, float]:
    """Returns the ranges of a scan, and the greatest one [m]."""
    return scan.ranges, scan.max_range


def _ranges_of_hits(
    beams: int, max_range: float, excess: float, scan: Scan
) -> tuple[DoubleArray, float]:
    """Returns the ranges of another laser at the origin of the robot, and the greatest one [m].

    Args:
        beams: Number of its beams, at equal angles all around, the first one backwards.
        max_range: Its range [m].
        excess: Length by which all hits are nearer [m].
        scan: The scan.
    """
    ranges = np.full(beams, max_range)
    x, y = scan.points.T
    beam = np.rint((np.arctan2(y, x) + math.pi) * (beams / math.tau)).astype(np.int64) % beams
    np.minimum.at(ranges, beam, np.maximum(np.hypot(x, y) - excess, 0.0))
    return ranges, max_range


class _Follower:
    """Computes the observation, and follows the action of a policy."""

    def __init__(
        self,
        task: Task,
        act: Callable[[Any], Any],
        low: DoubleArray,
        high: DoubleArray,
        parts: Observation,
        view: Callable[[Scan], tuple[DoubleArray, float]],
    ) -> None:
        """Prepares a run.

        Args:
            task: The task.
            act: Returns the action of an observation.
            low: Velocities of the action (-1, -1) [m/s, rad/s], shape (2,).
            high: Velocities of the action (1, 1), shape (2,).
            parts: The observation.
            view: Returns the ranges that are observed in a scan, and the greatest one [m].
        """
        self._task = task
        self._act = act
        self._low, self._high = low, high
        self._parts = parts
        self._view = view
        self._situation: Situation | None = None

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Returns the velocities of the action."""
        ranges, max_range = self._view(scan)
        s = self._situation
        if s is None:
            s = Situation(1, len(ranges), max_range, self._low, self._high)
            self._situation = s
            self._layout = self._parts.layout(len(ranges))
        s.ranges[0] = ranges
        s.poses[0] = pose
        s.velocities[0] = self._task.robot.bodies[0].velocity
        s.goals[0] = goal
        s.locate(_GOAL_RADIUS)
        numbers = np.zeros((1, self._layout.size), np.float32)
        self._layout.write(s, numbers)
        wanted = np.asarray(self._act(self._layout.present(numbers[0])), float)
        action = np.clip(wanted, -1.0, 1.0)
        s.actions[0] = action
        v, omega = (self._low + (action + 1.0) * (0.5 * (self._high - self._low))).tolist()
        return Twist(linear_x=v, angular_z=omega)
