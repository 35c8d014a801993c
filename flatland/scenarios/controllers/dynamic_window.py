"""A controller that simulates the reachable velocities for a short time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.scenarios.controllers.guide import Guide
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import DoubleArray, Pose, Vector2
    from flatland.scenarios.task import Scan, Task


class DynamicWindow:
    """Chooses the best of the velocities that the robot can reach within a period.

    Each candidate is a circular arc for the next `_HORIZON` seconds. It is rated by its distance to
    the points of the scan, its progress towards the goal and its speed, as by D. Fox, W. Burgard
    and S. Thrun, "The dynamic window approach to collision avoidance", IEEE Robotics & Automation
    Magazine 4(1), 1997. As in navigation stacks, the goal of the arcs is a point ahead on a path
    that is planned on the map of the walls; everything else is only in the scan. If no arc is free,
    the robot turns on the spot, which counts as a recovery.

    Attributes:
        recoveries: Number of times that it began to turn on the spot because no arc was free.
    """

    _HORIZON: Final = 1.6  # s
    _LOOKAHEAD: Final = 1.0  # distance of the point on the path [m]
    _SAMPLES: Final = 8  # points of an arc that are checked
    _SPEEDS: Final = 7
    _TURNS: Final = 15
    _ACCELERATION: Final = 1.5  # assumed ability of the robot [m/s^2]
    _TURN_ACCELERATION: Final = 5.0  # [rad/s^2]
    _TURN: Final = math.radians(80)  # bearing above which it turns on the spot
    _MAX_POINTS: Final = 60  # of a scan
    _RECOVERY: Final = 1.0  # least time of a turn on the spot [s]
    _MARGIN: Final = 0.06  # distance that an arc must keep to obstacles [m]
    _COMFORT: Final = 0.5  # distance above which obstacles have no influence [m]
    _W_GOAL: Final = 1.0
    _W_CLEARANCE: Final = 0.5
    _W_SPEED: Final = 0.15

    def __init__(self, task: Task) -> None:
        """Starts at rest."""
        self._task = task
        self._guide = Guide(task, only_walls=True)
        self._speed = self._turn = 0.0
        self._left = 0.0  # time of the turn on the spot [s]
        self._side = 1.0
        self.recoveries = 0
        self._times = np.linspace(0, self._HORIZON, self._SAMPLES + 1)[1:]

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Returns the velocities with the best rating."""
        goal = self._guide.target(pose, goal, self._LOOKAHEAD) or goal
        speeds, turns = self._candidates()
        arcs = self._arcs(speeds, turns)
        gap = self._gaps(arcs, scan)
        # A robot that is closer to an obstacle than the margin may move away from it.
        margin = min(self._MARGIN, self._gap_now(scan) - 0.005)
        # It must be able to stop within its distance to obstacles, apart from slow motions.
        room = np.maximum(gap - margin, 0.0)
        is_free = (gap > margin) & (speeds <= 0.1 + np.sqrt(2 * self._ACCELERATION * room))
        bearing = math.atan2(goal[1] - pose[1], goal[0] - pose[0]) - pose[2]
        distance = math.hypot(goal[1] - pose[1], goal[0] - pose[0])
        is_ahead = speeds > 0.02
        if self._left > 0 or not (is_free & is_ahead).any():
            return self._recover(bearing)
        target = np.array([math.cos(bearing), math.sin(bearing)]) * distance
        left = np.hypot(*np.moveaxis(arcs[:, :, :2] - target, -1, 0)).min(axis=1)
        progress = (distance - left) / (self._task.max_speed * self._HORIZON)
        headings = np.remainder(bearing - arcs[:, -1, 2] + np.pi, math.tau) - np.pi
        rating = (
            self._W_GOAL * (progress + 0.3 * np.cos(headings))
            + self._W_CLEARANCE * np.minimum(gap, self._COMFORT)
            + self._W_SPEED * speeds / self._task.max_speed
        )
        # Behind the robot, the point is reached by turning first.
        is_behind = abs(math.remainder(bearing, math.tau)) > self._TURN
        if is_behind:
            return self._turn_towards(bearing)
        best = int(np.argmax(np.where(is_free, rating, -np.inf)))
        self._speed, self._turn = float(speeds[best]), float(turns[best])
        return Twist(linear_x=self._speed, angular_z=self._turn)

    def _turn_towards(self, bearing: float) -> Twist:
        """Returns a turn on the spot."""
        self._speed = 0.0
        self._turn = math.copysign(0.7 * self._task.max_turn, math.remainder(bearing, math.tau))
        return Twist(angular_z=self._turn)

    def _gap_now(self, scan: Scan) -> float:
        """Returns the distance of the robot to the nearest point of the scan [m]."""
        if not len(scan.points):
            return self._COMFORT
        return float(np.hypot(*scan.points.T).min()) - self._task.radius

    def _candidates(self) -> tuple[DoubleArray, DoubleArray]:
        """Returns the reachable speeds and yaw rates, shape (n,) each."""
        task = self._task
        dv, dw = self._ACCELERATION * task.period, self._TURN_ACCELERATION * task.period
        speeds = np.linspace(
            max(0.0, self._speed - dv), min(task.max_speed, self._speed + dv), self._SPEEDS
        )
        turns = np.linspace(
            max(-task.max_turn, self._turn - dw), min(task.max_turn, self._turn + dw), self._TURNS
        )
        grid = np.stack(np.meshgrid(speeds, turns), axis=-1).reshape(-1, 2)
        return grid[:, 0], grid[:, 1]

    def _arcs(self, speeds: DoubleArray, turns: DoubleArray) -> DoubleArray:
        """Returns the poses along each arc in the frame of the robot, shape (n, samples, 3)."""
        angles = turns[:, None] * self._times
        safe = np.where(np.abs(turns) < 1e-6, 1.0, turns)[:, None]
        v = speeds[:, None]
        is_straight = np.abs(turns)[:, None] < 1e-6
        x = np.where(is_straight, v * self._times, v / safe * np.sin(angles))
        y = np.where(is_straight, 0.0, v / safe * (1 - np.cos(angles)))
        return np.stack((x, y, angles), axis=-1)

    def _gaps(self, arcs: DoubleArray, scan: Scan) -> DoubleArray:
        """Returns the least distance of the robot to obstacles along each arc [m], shape (n,)."""
        reach = self._task.max_speed * self._HORIZON + self._task.radius + self._COMFORT
        points = scan.points[np.abs(scan.points).max(axis=1) < reach]
        if not len(points):
            return np.full(len(arcs), self._COMFORT)
        points = points[:: math.ceil(len(points) / self._MAX_POINTS)]
        difference = arcs[:, :, None, :2] - points
        squares = np.einsum("ijkl,ijkl->ijk", difference, difference)
        gaps: DoubleArray = np.sqrt(squares.min(axis=(1, 2))) - self._task.radius
        return gaps

    def _recover(self, bearing: float) -> Twist:
        if self._left <= 0:
            self._left = self._RECOVERY
            self.recoveries += 1
            self._guide.plan_again()
            self._side = math.copysign(1.0, math.remainder(bearing, math.tau))
        self._left -= self._task.period
        self._speed, self._turn = 0.0, self._side * 0.6 * self._task.max_turn
        return Twist(angular_z=self._turn)
