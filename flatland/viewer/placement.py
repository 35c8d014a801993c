"""State of the spawn tool: a first click sets the position of a model, a second one its heading."""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import Final

from flatland.geometry import Pose

_MIN_HEADING_DISTANCE: Final = 1e-6  # m between position and mouse, for a defined direction


class Stage(Enum):
    """What the mouse sets at present."""

    POSITION = auto()
    HEADING = auto()
    DONE = auto()


class Placement:
    """The pose of a model while it is being placed with the mouse.

    Attributes:
        stage: What the mouse sets at present.
        pose: (x, y, theta) in the world frame [m, rad].
    """

    def __init__(self) -> None:
        """Starts at the origin, in the stage `POSITION`."""
        self.stage = Stage.POSITION
        self.pose: Pose = (0.0, 0.0, 0.0)

    def move(self, x: float, y: float) -> None:
        """Updates the pose for a mouse position (x, y) in the world frame [m]."""
        if self.stage is Stage.POSITION:
            self.pose = (x, y, 0.0)
        elif self.stage is Stage.HEADING:
            dx, dy = x - self.pose[0], y - self.pose[1]
            if math.hypot(dx, dy) > _MIN_HEADING_DISTANCE:
                self.pose = (self.pose[0], self.pose[1], math.atan2(dy, dx))

    def click(self, x: float, y: float) -> None:
        """Updates the pose for a click at (x, y) in the world frame [m]; enters the next stage."""
        self.move(x, y)
        self.stage = Stage.HEADING if self.stage is Stage.POSITION else Stage.DONE
