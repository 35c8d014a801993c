"""Free places of a map, prepared once, from which each episode draws in constant time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.errors import WorldError
from flatland.geometry import BoolArray, Bounds, DoubleArray, Pose, Vector2, bounds_of
from flatland.runtime.free_space import FreeSpace

if TYPE_CHECKING:
    from flatland.gym.agents import Agent
    from flatland.physics import PhysicsBody

_TRIES: Final = 2000


class Places:
    """The free places of a map that an agent can reach from its pose in the world file.

    They depend only on the walls, so that copies of a world share them. An exact test in the world
    of the episode verifies that a drawn place is free of walls and models.

    Attributes:
        radius: Radius of the disc that must fit [m].
        clearance: Distance that it keeps from walls and models [m].
        bounds: (x_min, y_min, x_max, y_max) of the walls [m].
    """

    def __init__(self, agent: Agent, clearance: float, origin: Vector2 | None = None) -> None:
        """Prepares the grid of free places.

        Args:
            agent: The agent; models are not regarded as obstacles.
            clearance: Distance to keep from walls and models [m].
            origin: A place in the world frame [m] from which all others can be reached; None for
                the place of the agent, or, if it does not fit there, for the largest region.

        Raises:
            WorldError: The world has no walls, or no free place.
            ValueError: The clearance is negative or not finite.
        """
        if not (math.isfinite(clearance) and clearance >= 0):
            raise ValueError(f"clearance must be finite and not negative [m], got {clearance}")
        world = agent.world
        self.radius, self.clearance, self._bits = agent.radius, clearance, agent.bits
        layers = [layer for layer in world.layers if layer.category_bits & agent.bits]
        walls = np.concatenate([np.empty((0, 4)), *(layer.world_edges for layer in layers)])
        bounds = bounds_of(walls.reshape(-1, 2))
        if bounds is None:
            raise WorldError(f'no layer has walls for model "{agent.model.name}": no area to drive')
        self.bounds: Bounds = bounds
        bodies = [layer.body.physics for layer in layers]

        def fits(points: DoubleArray, disc: float) -> BoolArray:
            poses = np.column_stack((points, np.zeros(len(points))))
            return world.physics.free_discs(poses, disc, agent.bits, only=bodies)

        self._space = FreeSpace(walls, bounds, agent.radius, clearance, fits)
        start = agent.body.pose[:2] if origin is None else origin
        if origin is None and not _fits_at(start, bounds, agent.radius, fits):
            self._cells = self._space.largest_region()
        else:
            self._cells = self._space.cells(start)
        if not len(self._cells):
            raise WorldError(
                f"no place is free for a disc of radius {agent.radius:g} m with a clearance of "
                f"{clearance:g} m"
            )
        self._reachable = np.zeros(self._space.size, np.bool_)
        self._reachable[self._cells] = True
        self._regions = self._space.regions_of(self._cells)

    def draw(
        self,
        agent: Agent,
        rng: np.random.Generator,
        *,
        near: Sequence[float] | None = None,
        distance: tuple[float, float] = (0.0, math.inf),
        margin: float | None = None,
        ignored: Iterable[PhysicsBody] = (),
        apart_from: Sequence[Vector2] = (),
    ) -> Vector2:
        """Draws a free place.

        Args:
            agent: The agent that is to fit; its own bodies are ignored.
            rng: Source of the random numbers.
            near: Point in the world frame [m] that limits `distance`.
            distance: Least and greatest straight distance from `near` [m].
            margin: Distance by which a path from `near` may leave the rectangle around it and the
                place [m]; None for any path.
            ignored: Other bodies that may be overlapped.
            apart_from: Places from which a disc there must have the clearance [m].

        Returns:
            The place (x, y) in the world frame [m].

        Raises:
            WorldError: No free place was found.
        """
        skipped = [*agent.model.bodies, *ignored]
        for _ in range(_TRIES):
            place = self._any(rng) if near is None else self._around(rng, near, distance)
            if place is None or self._is_near(place, apart_from):
                continue
            if not self.is_free(agent, place, skipped):
                continue
            if near is None or margin is None or self._is_close(near, place, margin):
                return place
        where = ""
        if near is not None:
            low, high = distance
            where = f" from {low:g} to {high:g} m from ({near[0]:g}, {near[1]:g})"
        raise WorldError(
            f'no free place{where} for model "{agent.model.name}" with a clearance of '
            f"{self.clearance:g} m: {_TRIES} tries"
        )

    def is_free(self, agent: Agent, place: Sequence[float], ignored: Iterable[PhysicsBody]) -> bool:
        """Returns whether a disc of the size of the agent has the clearance at a place."""
        pose = np.array([[place[0], place[1], 0.0]])
        free = agent.world.physics.free_discs(
            pose, self.radius, self._bits, ignored=ignored, least_gap=self.clearance
        )
        return bool(free[0])

    def is_reachable(self, place: Sequence[float]) -> bool:
        """Returns whether a place belongs to the region of the free places."""
        cell = self._space.cell_at(place[0], place[1])
        return cell is not None and bool(self._reachable[cell])

    def check_path(
        self, name: str, place: Sequence[float], start: Sequence[float] | None = None
    ) -> None:
        """Checks that a path leads to a place.

        A passage that is wider than the disc by less than a cell of the grid may be regarded as
        closed.

        Args:
            name: What is at the place, for the error.
            place: The place in the world frame [m].
            start: Start of the path in the world frame [m]; None for the free places.

        Raises:
            WorldError: There is no path.
        """
        x, y = place[0], place[1]
        reached = self._regions if start is None else self._space.regions_at(start[0], start[1])
        if self._space.regions_at(x, y) & reached:
            return
        x_min, y_min, x_max, y_max = self.bounds
        reason = f"no path of a disc of radius {self.radius:g} m leads there"
        if not (x_min <= x <= x_max and y_min <= y <= y_max):
            walls = f"({x_min:g}, {y_min:g}) to ({x_max:g}, {y_max:g})"
            reason = f"it is outside of the walls, which extend from {walls}"
        raise WorldError(f"the {name} ({x:g}, {y:g}) cannot be reached: {reason}")

    def _any(self, rng: np.random.Generator) -> Vector2:
        numbers = rng.random(3)
        cell = self._cells[int(numbers[0] * len(self._cells))]
        return self._space.point_in(int(cell), float(numbers[1]), float(numbers[2]))

    def _around(
        self, rng: np.random.Generator, near: Sequence[float], distance: tuple[float, float]
    ) -> Vector2 | None:
        """Returns a random point of the annulus if its cell is free, uniform over the area."""
        low, high = distance
        numbers = rng.random(2)
        r = math.sqrt(low * low + float(numbers[0]) * (high * high - low * low))
        phi = math.tau * float(numbers[1])
        place = (near[0] + r * math.cos(phi), near[1] + r * math.sin(phi))
        return place if self.is_reachable(place) else None

    def _is_close(self, near: Sequence[float], place: Vector2, margin: float) -> bool:
        return self._space.is_connected_within((near[0], near[1]), place, margin)

    def _is_near(self, place: Vector2, others: Sequence[Vector2]) -> bool:
        least = 2 * self.radius + self.clearance
        return any(math.hypot(x - place[0], y - place[1]) < least for x, y in others)


def _fits_at(
    place: Vector2, bounds: Bounds, radius: float, fits: Callable[[DoubleArray, float], BoolArray]
) -> bool:
    x_min, y_min, x_max, y_max = bounds
    is_inside = x_min <= place[0] <= x_max and y_min <= place[1] <= y_max
    return is_inside and bool(fits(np.array([place]), radius)[0])


def random_pose(place: Vector2, rng: np.random.Generator) -> Pose:
    """Returns a pose at a place with a random heading from -pi to pi."""
    return (*place, math.pi * (2.0 * float(rng.random()) - 1.0))
