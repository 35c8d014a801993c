"""A controller that drives into the open direction closest to the goal."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from flatland.controllers.base import (
    Capabilities,
    Controller,
    Perception,
    check_positive,
)
from flatland.geometry import DoubleArray

MARGIN: Final = 0.05
"""Default distance to keep from obstacles [m]."""
_HEADINGS: Final = 49
_WIDEST: Final = 2.0  # rad, within the view of a usual scanner
_SHORTEST: Final = 0.01  # m, free distance below which headings are not compared
_STANDING: Final = 0.02  # m, free distance with which the robot stands


class Gap(Controller):
    """Drives along the free heading that is nearest to the goal.

    Of 49 headings up to 2 rad to each side, and that of the goal, the scan determines how far the
    disc of the robot can drive along each. Those with enough free distance, or along which the goal
    can be reached, are compared by the angle to the goal and to the heading before, if it is known;
    without any, half of the distance is enough, and so on.
    """

    def __init__(
        self,
        robot: Capabilities,
        *,
        margin: float = MARGIN,
        distance: float = 2.0,
        persistence: float = 0.3,
        turn_time: float = 0.5,
    ) -> None:
        """Creates the controller.

        Args:
            robot: The capabilities of the robots.
            margin: Distance to keep from obstacles [m].
            distance: Free distance that a heading needs [m].
            persistence: Cost of an angle to the heading before, relative to one to the goal.
            turn_time: Time in which a robot would turn to its heading [s].

        Raises:
            ValueError: A number is not positive, or the persistence is negative.
        """
        super().__init__(robot)
        check_positive("margin", margin)
        check_positive("distance", distance)
        check_positive("turn_time", turn_time)
        if not persistence >= 0:
            raise ValueError(f"persistence must not be negative, got {persistence}")
        self.margin = margin
        self.distance = distance
        self.persistence = persistence
        self.turn_time = turn_time
        self._headings = np.linspace(-_WIDEST, _WIDEST, _HEADINGS)

    def choose(self, perception: Perception) -> DoubleArray:
        """Returns commands along the best headings."""
        return self.commands(*self.best(perception))

    def commands(self, headings: DoubleArray, free: DoubleArray) -> DoubleArray:
        """Returns the commands that follow from the result of `best`, shape (n, 2)."""
        return self.towards(headings, free, self.turn_time)

    def best(
        self, perception: Perception, before: DoubleArray | None = None
    ) -> tuple[DoubleArray, DoubleArray]:
        """Returns the best headings and how far they are free.

        Args:
            perception: What the robots perceive.
            before: Headings that were chosen before, in the present frames of the robots [rad],
                NaN for none, shape (n,); None for none of them.

        Returns:
            Headings in the frames of the robots [rad], and the free distances on the way [m],
            shape (n,) each.
        """
        goals = perception.goals
        bearings = np.arctan2(goals[:, 1], goals[:, 0])
        headings = np.column_stack((np.tile(self._headings, (len(goals), 1)), bearings))
        free = self.free(perception, headings)
        # Of headings with equal angles, the one that needs least turning.
        cost = _angles(headings, bearings) + 0.1 * np.abs(headings)
        if before is not None:
            cost += self.persistence * np.nan_to_num(_angles(headings, before))
        most = free.max(axis=1)
        needed = np.minimum(np.hypot(goals[:, 0], goals[:, 1]), self.distance)
        halvings = np.ceil(np.log2(needed / np.maximum(most, _SHORTEST)))
        needed *= 0.5 ** np.clip(halvings, 0.0, None)
        enough = np.minimum(needed, most)[:, np.newaxis]
        best = np.argmin(np.where(free >= enough, cost, math.inf), axis=1)
        rows = np.arange(len(goals))
        # Until the robot has turned, it drives on along its present heading.
        ahead = free[:, _HEADINGS // 2]
        return headings[rows, best], np.minimum(free[rows, best], ahead)

    def free(self, perception: Perception, headings: DoubleArray) -> DoubleArray:
        """Returns how far each robot can drive along headings [m].

        Args:
            perception: What the robots perceive.
            headings: Headings in the frames of the robots [rad], shape (n, headings).
        """
        ahead, left = perception.points[..., 0], perception.points[..., 1]
        reach = self.robot.radius + self.margin
        gaps = np.hypot(ahead, left)
        # Points within the margin block only the ways that lead nearer to them.
        discs = np.minimum(reach, np.maximum(gaps - 1e-3, 0.0))[:, np.newaxis]
        c, s = np.cos(headings)[..., np.newaxis], np.sin(headings)[..., np.newaxis]
        along = c * ahead[:, np.newaxis] + s * left[:, np.newaxis]
        across = c * left[:, np.newaxis] - s * ahead[:, np.newaxis]
        squared = discs * discs - across * across
        blocks = (squared > 0.0) & (along > 0.0) & perception.is_hit[:, np.newaxis]
        distances = np.where(
            blocks, along - np.sqrt(np.maximum(squared, 0.0)), perception.max_range
        )
        # So that the robot stands before an obstacle instead of creeping towards it.
        free: DoubleArray = distances.min(axis=2, initial=perception.max_range) - _STANDING
        return free


def _angles(headings: DoubleArray, others: DoubleArray) -> DoubleArray:
    """Returns the angles between headings and another one of each row, from 0 to pi [rad]."""
    angles: DoubleArray = np.abs((headings - others[:, np.newaxis] + math.pi) % math.tau - math.pi)
    return angles
