"""A controller that simulates the reachable velocities for a short time."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from flatland.controllers.base import DECELERATION, Capabilities, Perception, check_positive
from flatland.controllers.gap import MARGIN, Gap
from flatland.geometry import DoubleArray

_GROUPS: Final = 60  # obstacle points that are considered, at most


class DynamicWindow(Gap):
    """Chooses the best of the velocities that can be reached within an action.

    It aims at a place along the heading that `Gap` chooses, at most `distance` away.

    For each velocity, the robot is predicted along an arc. Velocities with which it could not stop
    before an obstacle are excluded. The others are rated by the distance of the arc from that
    place, and by their clearance: D. Fox, W. Burgard, S. Thrun, "The dynamic window
    approach to collision avoidance", IEEE Robotics & Automation Magazine 4 (1997).
    """

    def __init__(
        self,
        robot: Capabilities,
        *,
        acceleration: tuple[float, float] = (2.0, 8.0),
        horizon: float = 1.5,
        samples: tuple[int, int] = (6, 15),
        margin: float = MARGIN,
        distance: float = 1.0,
        clearance: float = 0.3,
        clearance_weight: float = 0.6,
    ) -> None:
        """Creates the controller; the accelerations are those of the included robot.

        Args:
            robot: The capabilities of the robots.
            acceleration: Limits of the acceleration of the drive [m/s², rad/s²].
            horizon: Duration of the predicted arcs [s].
            samples: Number of speeds and of yaw rates, at least 2 each.
            margin: Distance to keep from obstacles [m].
            distance: Free distance that a heading needs, see `Gap` [m].
            clearance: Distance beyond which an obstacle does not matter [m].
            clearance_weight: Distance from the place ahead that costs as much as a metre of missing
                clearance.

        Raises:
            ValueError: A number is out of range.
        """
        super().__init__(robot, margin=margin, distance=distance)
        check_positive("acceleration", min(acceleration))
        check_positive("horizon", horizon)
        check_positive("clearance", clearance)
        if not clearance_weight >= 0:
            raise ValueError(f"clearance_weight must not be negative, got {clearance_weight}")
        if min(samples) < 2:
            raise ValueError(f"samples must be at least 2 each, got {samples}")
        self.acceleration = acceleration
        self.horizon = horizon
        self.samples = samples
        self.clearance = clearance
        self.clearance_weight = clearance_weight

    def choose(self, perception: Perception) -> DoubleArray:
        """Returns the best commands.

        Raises:
            ValueError: The velocities are not known.
        """
        if perception.velocities is None:
            raise ValueError("velocities are required")
        change = self.robot.period * np.array(self.acceleration)
        low = np.maximum(self.robot.low, perception.velocities - change)
        high = np.maximum(np.minimum(self.robot.high, perception.velocities + change), low)
        fractions = [np.linspace(0.0, 1.0, count) for count in self.samples]
        v = low[:, :1] + (high - low)[:, :1] * fractions[0]
        omega = low[:, 1:] + (high - low)[:, 1:] * fractions[1]
        v = np.repeat(v, len(fractions[1]), axis=1)  # shape (n, count)
        omega = np.tile(omega, len(fractions[0]))
        times = np.linspace(0.0, self.horizon, 9)[1:]
        ahead, left = _arcs(v, omega, times)  # shape (n, count, times)
        gaps = self._gaps(perception, ahead, left)
        # The time until the robot stands, if it brakes after this action.
        stopping = self.robot.period + v / DECELERATION
        is_before = times <= stopping[..., np.newaxis] + times[0]
        # Within the margin, the robot may drive if it does not come nearer.
        zero = np.zeros((len(v), 1, 1))
        least = np.minimum(self.margin, 0.95 * self._gaps(perception, zero, zero)[:, 0])
        is_safe = (np.where(is_before, gaps, math.inf).min(axis=2) > least) | (v <= 0.0)
        bearings, _ = self.best(perception)
        lengths = np.minimum(
            np.hypot(perception.goals[:, 0], perception.goals[:, 1]), self.distance
        )
        goal_ahead = (lengths * np.cos(bearings))[:, np.newaxis]
        goal_left = (lengths * np.sin(bearings))[:, np.newaxis]
        # An arc may end there before the horizon.
        remaining = np.hypot(
            ahead - goal_ahead[..., np.newaxis], left - goal_left[..., np.newaxis]
        ).min(axis=2)
        turned = np.arctan2(goal_left - left[..., -1], goal_ahead - ahead[..., -1])
        turned = np.abs((turned - omega * self.horizon + math.pi) % math.tau - math.pi)
        near = self.clearance - np.clip(gaps.min(axis=2), 0.0, self.clearance)
        cost = remaining + self.clearance_weight * near + 0.1 * turned
        cost[~is_safe] = math.inf
        best = np.argmin(cost, axis=1)
        rows = np.arange(len(v))
        commands: DoubleArray = np.stack((v[rows, best], omega[rows, best]), axis=1)
        # Without any safe velocity, the robot brakes and turns there.
        blocked = ~is_safe.any(axis=1)
        commands[blocked, 0] = low[blocked, 0]
        commands[blocked, 1] = np.clip(bearings[blocked], low[blocked, 1], high[blocked, 1])
        return commands

    def _gaps(self, perception: Perception, ahead: DoubleArray, left: DoubleArray) -> DoubleArray:
        """Returns the gap between the robot and the obstacles at predicted positions [m]."""
        points = np.where(perception.is_hit[..., np.newaxis], perception.points, math.inf)
        beams = points.shape[1]
        size = -(-beams // _GROUPS)
        if size > 1:
            # The nearest point of each group of neighbouring beams.
            padding = -beams % size
            points = np.pad(points, ((0, 0), (0, padding), (0, 0)), constant_values=math.inf)
            groups = points.reshape(len(points), -1, size, 2)
            nearest = np.argmin((groups * groups).sum(axis=3), axis=2)
            points = np.take_along_axis(groups, nearest[..., None, None], axis=2)[:, :, 0]
        dx = ahead[..., np.newaxis] - points[:, None, None, :, 0]
        dy = left[..., np.newaxis] - points[:, None, None, :, 1]
        gaps: DoubleArray = (
            np.sqrt((dx * dx + dy * dy).min(axis=3, initial=math.inf)) - self.robot.radius
        )
        return gaps


def _arcs(
    v: DoubleArray, omega: DoubleArray, times: DoubleArray
) -> tuple[DoubleArray, DoubleArray]:
    """Returns the positions (ahead, left) after times at constant velocities.

    Args:
        v: Forward speeds [m/s], shape (n, count).
        omega: Yaw rates [rad/s], shape (n, count).
        times: Times [s], shape (k,).
    """
    angle = omega[..., np.newaxis] * times
    length = v[..., np.newaxis] * times
    half = 0.5 * angle
    chord = length * np.sinc(half / math.pi)
    ahead: DoubleArray = chord * np.cos(half)
    left: DoubleArray = chord * np.sin(half)
    return ahead, left
