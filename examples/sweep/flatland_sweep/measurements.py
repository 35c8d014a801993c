"""What is measured during an episode, from the true state of the world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from flatland import Model, World
    from flatland.geometry import Pose

_MAX_CLEARANCE: Final = 100.0  # m; obstacles farther away are not searched
_PRECISION: Final = 1e-3  # of the clearance [m]


class Measurements:
    """Path, collisions and clearance of a robot; `update` is called after each step.

    Attributes:
        path_length: Length of the path of the origin of the robot [m].
        collisions: Number of times that the robot began to touch a wall layer or another model.
        min_clearance: Smallest distance between the robot and an obstacle, to the millimetre below
            [m]; infinite if there was none within 100 m.
    """

    def __init__(self, world: World, robot: Model) -> None:
        """Starts at the current pose of the robot.

        Args:
            world: The world.
            robot: The robot.
        """
        self._physics = world.physics
        self._robot = robot
        self._own = {body.id for body in robot.bodies}
        self._owners = {
            body.id: model.name
            for model in world.models
            if model is not robot
            for body in model.bodies
        }
        self._pose = robot.pose
        self._touched: set[object] = self._touching()
        self.path_length = 0.0
        self.collisions = 0
        self.min_clearance = math.inf
        if not self._is_nearer(_MAX_CLEARANCE):
            return
        self.min_clearance = _MAX_CLEARANCE
        self._reduce_clearance()

    def update(self) -> Pose:
        """Adds the last step; returns the pose of the robot."""
        pose = self._robot.pose
        self.path_length += math.hypot(pose[0] - self._pose[0], pose[1] - self._pose[1])
        self._pose = pose
        touching = self._touching()
        self.collisions += len(touching - self._touched)
        self._touched = touching
        if touching:
            self.min_clearance = 0.0
        elif self.min_clearance > 0 and self._is_nearer(min(self.min_clearance, _MAX_CLEARANCE)):
            self.min_clearance = min(self.min_clearance, _MAX_CLEARANCE)
            self._reduce_clearance()
        return pose

    def _touching(self) -> set[object]:
        """Returns the obstacles that the robot touches: names of models, ids of other bodies."""
        touching: set[object] = set()
        for contact in self._physics.contacts():
            a, b = contact.body_a, contact.body_b
            if contact.is_sensor or (a in self._own) == (b in self._own):
                continue
            other = b if a in self._own else a
            touching.add(self._owners.get(other, other))
        return touching

    def _is_nearer(self, distance: float) -> bool:
        """Returns whether an obstacle is nearer than a distance [m]."""
        bodies = self._robot.bodies
        return bool(self._physics.overlapping_bodies(bodies, self._pose, least_gap=distance))

    def _reduce_clearance(self) -> None:
        """Finds the clearance, which is known to be smaller than `min_clearance`, by bisection."""
        low, high = 0.0, self.min_clearance
        while high - low > _PRECISION:
            middle = (low + high) / 2
            if self._is_nearer(middle):
                high = middle
            else:
                low = middle
        self.min_clearance = low
