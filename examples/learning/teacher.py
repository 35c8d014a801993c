"""A teacher that uses the map: `Gap`, which aims at a place ahead on the way to the goal."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland import controllers
from flatland.gym.controllers import Gap

if TYPE_CHECKING:
    from flatland.geometry import DoubleArray, Vector2
    from flatland.gym import FlatlandVectorEnv
    from flatland.physics import Crowd
    from flatland.world import World

_DISTANCE: Final = 1.0  # m, free distance that a heading needs
_SPACING: Final = 0.2  # m, of the points on the way
_AHEAD: Final = 4  # number of points to the place ahead
_CELL: Final = 0.1  # m, of the grid on which ways are planned
_MOST_GOALS: Final = 200  # goals whose ways are kept


class _Ways:
    """The fastest ways to goals in a building, on which the robot keeps away from walls."""

    def __init__(self, world: World, bits: int, clearance: float) -> None:
        """Creates the ways of a world in which nothing moves.

        Args:
            world: The world.
            bits: Category bits of the robot.
            clearance: Least distance of the way from walls [m].
        """
        self._world = world
        self._bits = bits
        self._clearance = clearance
        self._crowd: Crowd | None = None
        self._waypoints: dict[Vector2, int] = {}

    def ahead(self, place: Vector2, goal: Vector2) -> Vector2:
        """Returns a place ahead on the way from a place to a goal, all in the world frame [m]."""
        if self._crowd is None or len(self._waypoints) == _MOST_GOALS:
            self._crowd = self._renewed()
        if goal not in self._waypoints:
            self._waypoints[goal] = self._crowd.add_waypoint(goal, goal, _CELL)
        x, y = place
        for _ in range(_AHEAD):
            if math.hypot(goal[0] - x, goal[1] - y) < _SPACING:
                return goal
            dx, dy = self._crowd.way(self._waypoints[goal], (x, y))
            x, y = x + _SPACING * dx, y + _SPACING * dy
        return (x, y)

    def close(self) -> None:
        """Closes the world."""
        self._world.close()

    def _renewed(self) -> Crowd:
        """Returns a crowd without people, whose planner computes the ways."""
        if self._crowd is not None:
            self._crowd.remove()
        self._waypoints.clear()
        return self._world.physics.add_crowd(
            is_orca=False,
            is_dynamic=False,
            bits=self._bits,
            interval=1,
            key=0,
            numbers={"cell": _CELL, "clearance": self._clearance},
        )


class Teacher(Gap):
    """Chooses the heading of `Gap` for a place 0.8 m ahead on the way to the goal.

    The scan keeps it from obstacles that are not on the map, such as people.
    """

    def __init__(self, envs: FlatlandVectorEnv) -> None:
        """Creates the teacher for environments whose world is a collection of buildings."""
        super().__init__(envs)
        self._gap = controllers.Gap(self.robot, distance=_DISTANCE)
        self._envs = envs
        self._ways: dict[str, _Ways] = {}

    def headings(self, observations: Any) -> DoubleArray:
        """Returns the headings in the frames of the robots [rad], shape (n,).

        Args:
            observations: The last observations of the environments.
        """
        p = self._perceive(observations)
        targets = self._targets()
        headings: DoubleArray = np.arctan2(targets[:, 1], targets[:, 0])
        free = self._gap.free(p, headings[:, np.newaxis])[:, 0]
        # Only few robots need the other headings, whose computation takes most of the time.
        blocked = free < np.minimum(np.hypot(*targets.T), self._gap.distance)
        if blocked.any():
            rest = controllers.Perception(
                p.points[blocked], p.is_hit[blocked], targets[blocked], p.max_range
            )
            headings[blocked] = self._gap.best(rest)[0]
        return headings

    def _targets(self) -> DoubleArray:
        """Returns the places ahead in the frames of the robots [m], shape (n, 2)."""
        poses, goals = self._envs.poses, self._envs.goals
        places = [
            self._ways_in(world).ahead((x, y), (goal_x, goal_y))
            for world, (x, y, _), (goal_x, goal_y) in zip(
                self._envs.worlds, poses.tolist(), goals.tolist(), strict=True
            )
        ]
        dx, dy = (np.array(places) - poses[:, :2]).T
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        return np.stack((c * dx + s * dy, c * dy - s * dx), axis=1)

    def _ways_in(self, world: World) -> _Ways:
        name = Path(world.path).parent.name
        if name not in self._ways:
            settings = self._envs.episodes.settings
            buildings: Any = settings.world
            agent = self._envs.episodes.agents[0]
            # A world of its own, since those of the environments return to their start.
            own = buildings.load(buildings.worlds.index(name), None, settings.step_size)
            self._ways[name] = _Ways(own, agent.bits, agent.radius + self._gap.margin)
        return self._ways[name]

    def close(self) -> None:
        """Closes the worlds of the planner."""
        for ways in self._ways.values():
            ways.close()
