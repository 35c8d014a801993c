"""A controller that simulates the reachable velocities for a short time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import DoubleArray, Pose, Vector2
    from flatland.scenarios.task import Scan, Task


class DynamicWindow:
    """Chooses the best of the velocities that the robot can reach within a period.

    Each candidate is a circular arc for the next `_HORIZON` seconds. It is rated by its distance to
    the points of the scan, its progress towards the goal and its speed, as by D. Fox, W. Burgard
    and S. Thrun, "The dynamic window approach to collision avoidance", IEEE Robotics & Automation
    Magazine 4(1), 1997. If no arc is free, the robot turns on the spot, which counts as a recovery.

    Attributes:
        recoveries: Number of times that it began to turn on the spot because no arc was free.
    """

    _HORIZON: Final = 1.6  # s
    _SAMPLES: Final = 8  # points of an arc that are checked
    _SPEEDS: Final = 7
    _TURNS: Final = 15
    _ACCELERATION: Final = 1.5  # assumed ability of the robot [m/s^2]
    _TURN_ACCELERATION: Final = 5.0  # [rad/s^2]
    _MAX_POINTS: Final = 90  # of a scan
    _RECOVERY: Final = 1.0  # least time of a turn on the spot [s]
    _MARGIN: Final = 0.06  # distance that an arc must keep to obstacles [m]
    _COMFORT: Final = 0.5  # distance above which obstacles have no influence [m]
    _W_GOAL: Final = 1.0
    _W_CLEARANCE: Final = 0.5
    _W_SPEED: Final = 0.15

    def __init__(self, task: Task) -> None:
        """Starts at rest."""
        self._task = task
        self._speed = self._turn = 0.0
        self._left = 0.0  # time of the turn on the spot [s]
        self._side = 1.0
        self.recoveries = 0
        self._times = np.linspace(0, self._HORIZON, self._SAMPLES + 1)[1:]

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Returns the velocities with the best rating."""
        speeds, turns = self._candidates()
        arcs = self._arcs(speeds, turns)
        gap = self._gaps(arcs, scan)
        room = np.maximum(gap - self._MARGIN, 0.0)
        # The robot must be able to stop within its distance to obstacles.
        is_free = (gap > self._MARGIN) & (speeds <= np.sqrt(2 * self._ACCELERATION * room))
        bearing = math.atan2(goal[1] - pose[1], goal[0] - pose[0]) - pose[2]
        distance = math.hypot(goal[1] - pose[1], goal[0] - pose[0])
        if self._left > 0 or not (is_free & (speeds > 0)).any():
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
        best = int(np.argmax(np.where(is_free, rating, -np.inf)))
        self._speed, self._turn = float(speeds[best]), float(turns[best])
        return Twist(linear_x=self._speed, angular_z=self._turn)

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
            self._side = math.copysign(1.0, math.remainder(bearing, math.tau))
        self._left -= self._task.period
        self._speed, self._turn = 0.0, self._side * 0.6 * self._task.max_turn
        return Twist(angular_z=self._turn)
