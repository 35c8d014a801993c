"""A controller that drives straight to the goal."""

from __future__ import annotations

import numpy as np

from flatland.controllers.base import Controller, Perception
from flatland.geometry import DoubleArray


class Straight(Controller):
    """Turns to the goal and drives there, without regard for obstacles."""

    def choose(self, perception: Perception) -> DoubleArray:
        """Returns commands that lead straight to the goals."""
        ahead, left = perception.goals.T
        return self.towards(np.arctan2(left, ahead), np.hypot(ahead, left))
