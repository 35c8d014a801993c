"""How a model is placed with the mouse: a click for the place, turning, a second click."""

from __future__ import annotations

import math
from enum import Enum, auto

from flatland.geometry import Pose

_SMALLEST_TURN = 1e-6  # m between the two clicks; below there is no direction


class Stage(Enum):
    """What the next click does."""

    PLACE = auto()
    TURN = auto()
    DONE = auto()


class Placement:
    """The pose of a model while the mouse places it.

    Attributes:
        stage: What the next click does.
        pose: (x, y, theta) in the world frame [m, rad].
    """

    def __init__(self) -> None:
        """Starts at the origin; the first `move` brings the model to the mouse."""
        self.stage = Stage.PLACE
        self.pose: Pose = (0.0, 0.0, 0.0)

    def move(self, x: float, y: float) -> None:
        """Follows the mouse, at (x, y) in the world frame [m]."""
        if self.stage is Stage.PLACE:
            self.pose = (x, y, 0.0)
        elif self.stage is Stage.TURN:
            dx, dy = x - self.pose[0], y - self.pose[1]
            if math.hypot(dx, dy) > _SMALLEST_TURN:
                self.pose = (self.pose[0], self.pose[1], math.atan2(dy, dx))

    def click(self, x: float, y: float) -> None:
        """Fixes the place, then the heading, and is done."""
        self.move(x, y)
        self.stage = Stage.TURN if self.stage is Stage.PLACE else Stage.DONE
