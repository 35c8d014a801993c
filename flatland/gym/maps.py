"""Observations that are images: what the laser has measured, and what is around the robot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final
from weakref import WeakKeyDictionary

import numpy as np

from flatland.checks import checked_count, checked_positive
from flatland.geometry import BoolArray, DoubleArray, FloatArray
from flatland.gym.observations import ObservationPart

if TYPE_CHECKING:
    from flatland.gym.agents import Agent
    from flatland.gym.situation import Situation
    from flatland.world import World

_MAX_CELLS: Final = 4096  # along each axis
_FREE, _UNKNOWN, _OCCUPIED = 0.0, 127.0, 255.0
_WALLS, _MODELS, _GOAL = range(3)  # channels


class _Grid:
    """Square cells around a robot: the first row is ahead, the first column on the left.

    Attributes:
        count: Number of cells along each axis.
        resolution: Size of a cell [m].
        x: Centres of the cells of each row, ahead of the robot [m], shape (count,).
        y: Centres of the cells of each column, to the left [m], shape (count,).
    """

    def __init__(self, count: int, resolution: float) -> None:
        self.resolution = resolution = checked_positive("resolution", resolution, "m")
        self.count = count = checked_count("cells", count, 2, _MAX_CELLS)
        self.x: DoubleArray = (count / 2 - 0.5 - np.arange(count)) * resolution
        self.y = self.x

    @property
    def reach(self) -> float:
        """Distance of the edges from the robot [m]."""
        return 0.5 * self.count * self.resolution

    def cells_of(self, points: DoubleArray) -> tuple[Any, Any, BoolArray]:
        """Returns rows, columns and whether they are in the grid, for points (ahead, left) [m]."""
        indices = np.floor((self.reach - points) / self.resolution)
        is_inside: BoolArray = ((indices >= 0) & (indices < self.count)).all(axis=-1)
        rows, columns = np.moveaxis(np.where(is_inside[..., np.newaxis], indices, 0), -1, 0)
        return rows.astype(np.intp), columns.astype(np.intp), is_inside

    def window(self, center: DoubleArray, radius: float) -> tuple[slice, slice] | None:
        """Returns the rows and columns of cells that a disc may cover; None if there are none."""
        found = []
        for coordinate in center.tolist():
            first = math.floor((self.reach - coordinate - radius) / self.resolution)
            last = math.floor((self.reach - coordinate + radius) / self.resolution) + 1
            if last <= 0 or first >= self.count:
                return None
            found.append(slice(max(first, 0), min(last, self.count)))
        return found[0], found[1]


class Costmap(ObservationPart):
    """An occupancy grid around the robot, from the scan: the robot is in its centre, ahead is up.

    Cells with a hit are occupied, cells before a hit are free, and others are unknown: those behind
    hits, and those that no beam reaches.
    """

    name = "costmap"
    low = _FREE
    high = _OCCUPIED

    def __init__(self, cells: int = 64, resolution: float = 0.1, *, as_image: bool = True) -> None:
        """Creates the part.

        Args:
            cells: Number of cells along each axis.
            resolution: Size of a cell [m].
            as_image: Whether the costmap is an image of the type uint8, shape (cells, cells, 1),
                with 0 for free, 127 for unknown and 255 for occupied cells. Otherwise, it is an
                array of the type float32, shape (cells, cells), with 0, 0.5 and 1.

        Raises:
            ValueError: A number is out of range.
        """
        self._grid = _Grid(cells, resolution)
        self.as_image = as_image
        if as_image:
            self.dtype = np.uint8
        else:
            self.high = 1.0

    def size(self, beams: int) -> int:  # noqa: ARG002 - does not depend on the laser
        """Returns the number of cells."""
        return self._grid.count**2

    def shape(self, beams: int) -> tuple[int, ...]:  # noqa: ARG002
        """Returns the shape of the image, or of the array."""
        count = self._grid.count
        return (count, count, 1) if self.as_image else (count, count)

    def prepare(self, situation: Situation) -> None:
        """Assigns a beam to each cell.

        Raises:
            ValueError: The lasers of the agents differ.
        """
        laser = situation.agents[0].laser
        for agent in situation.agents:
            other = agent.laser
            if other.origin != laser.origin or not np.array_equal(other.beam_ends, laser.beam_ends):
                raise ValueError("Costmap requires lasers with the same origin and the same beams")
        x, y, theta = laser.origin
        c, s = math.cos(theta), math.sin(theta)
        self._origin: DoubleArray = np.array([x, y])
        ends = laser.beam_ends.astype(np.float64) / laser.range
        self._directions: DoubleArray = ends @ np.array([[c, s], [-s, c]])
        cells = np.stack(np.meshgrid(self._grid.x, self._grid.y, indexing="ij"), axis=-1)
        offsets = cells.reshape(-1, 2) - self._origin
        along = offsets @ self._directions.T
        self._beams = along.argmax(axis=1)
        self._distances: FloatArray = np.hypot(*offsets.T).astype(np.float32)
        # A cell belongs to a beam within half of the angle between two beams.
        least = self._distances * math.cos(min(abs(laser.angles.increment), math.pi) / 2)
        is_seen = along.max(axis=1) >= least - 1e-6
        self._distances[~is_seen] = np.inf

    def write(self, situation: Situation, out: FloatArray) -> None:
        """Writes the cells of all agents."""
        longest = np.float32(situation.max_range)
        ranges = np.maximum(np.where(situation.ranges < longest, situation.ranges, longest), 0.0)
        unknown = np.float32(_UNKNOWN if self.as_image else 0.5)
        out[:] = np.where(self._distances < ranges[:, self._beams], np.float32(_FREE), unknown)
        points = self._origin + ranges[..., np.newaxis] * self._directions
        rows, columns, is_inside = self._grid.cells_of(points)
        is_hit = is_inside & (ranges < longest)
        agents = np.nonzero(is_hit)[0]
        out[agents, rows[is_hit] * self._grid.count + columns[is_hit]] = self.high


class LocalMap(ObservationPart):
    """An image of the surroundings: the robot is in its centre, ahead is up.

    Its three channels are walls, other models and the goal: 255 where they are, else 0. Unlike a
    scan, it contains what is behind walls. A goal outside of the image is at its edge.
    """

    name = "map"
    low = 0.0
    high = 255.0
    dtype = np.uint8

    def __init__(self, pixels: int = 64, resolution: float = 0.1, goal_radius: float = 0.3) -> None:
        """Creates the part.

        Args:
            pixels: Number of pixels along each axis.
            resolution: Size of a pixel [m].
            goal_radius: Radius of the goal in the image [m].

        Raises:
            ValueError: A number is out of range.
        """
        self._grid = _Grid(pixels, resolution)
        self.goal_radius = checked_positive("goal_radius", goal_radius, "m")

    def size(self, beams: int) -> int:  # noqa: ARG002 - does not depend on the laser
        """Returns the number of values."""
        return 3 * self._grid.count**2

    def shape(self, beams: int) -> tuple[int, ...]:  # noqa: ARG002
        """Returns (pixels, pixels, 3)."""
        return (self._grid.count, self._grid.count, 3)

    def prepare(self, situation: Situation) -> None:
        """Prepares the memory of walls."""
        del situation
        self._walls: WeakKeyDictionary[
            World, tuple[object, DoubleArray, DoubleArray, DoubleArray]
        ] = WeakKeyDictionary()

    def write(self, situation: Situation, out: FloatArray) -> None:
        """Draws the images of all agents."""
        count = self._grid.count
        for row, agent in enumerate(situation.agents):
            image = np.zeros((count, count, 3), np.float32)
            x, y, theta = situation.poses[row].tolist()
            to_robot = _Frame(x, y, theta)
            edges = self._edges(agent, np.array([x, y]))
            self._draw_edges(image, _WALLS, to_robot.points(edges.reshape(-1, 2)))
            self._draw_models(image, agent, to_robot)
            goal = np.array([situation.goal_ahead[row], situation.goal_left[row]])
            limit = self._grid.reach - 0.5 * self._grid.resolution
            goal *= min(1.0, limit / max(np.abs(goal).max(), 1e-9))
            self._draw_disc(image, _GOAL, goal, self.goal_radius)
            out[row] = image.reshape(-1)

    def _edges(self, agent: Agent, place: DoubleArray) -> DoubleArray:
        """Returns the walls near a place that an agent can touch, world frame, shape (n, 4)."""
        world = agent.world
        layers = [layer for layer in world.layers if layer.category_bits & agent.bits]
        state = [(layer.body, layer.added_edges, layer.body.pose) for layer in layers]
        known = self._walls.get(world)
        if known is None or known[0] != state:
            edges = np.concatenate([np.empty((0, 4)), *(layer.world_edges for layer in layers)])
            ends = edges.reshape(-1, 2, 2)
            known = self._walls[world] = (state, edges, ends.min(axis=1), ends.max(axis=1))
        _, edges, low, high = known
        distance = math.sqrt(2.0) * self._grid.reach
        is_near = ((low <= place + distance) & (high >= place - distance)).all(axis=1)
        near: DoubleArray = edges[is_near]
        return near

    def _draw_edges(self, image: FloatArray, channel: int, ends: DoubleArray) -> None:
        """Draws segments, the ends of which alternate, in the frame of the robot."""
        start, step = ends[::2], ends[1::2] - ends[::2]
        reach = self._grid.reach
        # The part of each segment that is in the square (Liang and Barsky).
        with np.errstate(divide="ignore", invalid="ignore"):
            crossings = np.stack([(-reach - start) / step, (reach - start) / step])
        is_level, is_inside = step == 0.0, np.abs(start) <= reach
        enter = np.where(is_level, np.where(is_inside, 0.0, np.inf), crossings.min(axis=0))
        leave = np.where(is_level, np.where(is_inside, 1.0, -np.inf), crossings.max(axis=0))
        enter = np.maximum(enter.max(axis=1), 0.0)
        leave = np.minimum(leave.min(axis=1), 1.0)
        near = np.flatnonzero(enter <= leave)
        if not len(near):
            return
        start, step = (
            start[near] + step[near] * enter[near, np.newaxis],
            (step[near] * (leave - enter)[near, np.newaxis]),
        )
        counts = np.ceil(np.hypot(*step.T) / (0.5 * self._grid.resolution)).astype(np.intp) + 1
        which = np.repeat(np.arange(len(near)), counts)
        number = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = number / np.maximum(counts - 1, 1)[which]
        points = start[which] + step[which] * share[:, np.newaxis]
        rows, columns, is_inside = self._grid.cells_of(points)
        image[rows[is_inside], columns[is_inside], channel] = self.high

    def _draw_models(self, image: FloatArray, agent: Agent, to_robot: _Frame) -> None:
        for model in agent.world.models:
            if model is agent.model:
                continue
            for body in model.bodies:
                x, y, theta = body.pose
                for fixture in body.fixtures:
                    if fixture.is_sensor or not fixture.category_bits & agent.bits:
                        continue
                    vertices = fixture.vertices.astype(np.float64)
                    shape = np.array([fixture.center]) if fixture.shape == "circle" else vertices
                    c, s = math.cos(theta), math.sin(theta)
                    points = to_robot.points(shape @ np.array([[c, s], [-s, c]]) + (x, y))
                    if fixture.shape == "circle":
                        self._draw_disc(image, _MODELS, points[0], fixture.radius)
                    elif fixture.shape == "polygon":
                        self._draw_polygon(image, points)
                    else:
                        self._draw_edges(image, _MODELS, points)

    def _draw_disc(
        self, image: FloatArray, channel: int, center: DoubleArray, radius: float
    ) -> None:
        # At least the pixel of the centre.
        radius = max(radius, 0.75 * self._grid.resolution)
        window = self._grid.window(center, radius)
        if window is not None:
            x = self._grid.x[window[0], np.newaxis] - center[0]
            y = self._grid.y[window[1]] - center[1]
            image[(*window, channel)][x * x + y * y <= radius * radius] = self.high

    def _draw_polygon(self, image: FloatArray, corners: DoubleArray) -> None:
        center = corners.mean(axis=0)
        window = self._grid.window(center, float(np.hypot(*(corners - center).T).max()))
        if window is None:
            return
        x, y = self._grid.x[window[0], np.newaxis], self._grid.y[window[1]]
        is_inside = np.ones((x.shape[0], len(y)), np.bool_)
        # The corners are in counter-clockwise order.
        for (x1, y1), (x2, y2) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            is_inside &= (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1) >= 0.0
        image[(*window, _MODELS)][is_inside] = self.high


class _Frame:
    """The frame of a robot."""

    def __init__(self, x: float, y: float, theta: float) -> None:
        c, s = math.cos(theta), math.sin(theta)
        self._origin = np.array([x, y])
        self._rotation = np.array([[c, -s], [s, c]])

    def points(self, p_world: DoubleArray) -> DoubleArray:
        """Returns points (ahead, left) for points in the world frame [m], shape (n, 2)."""
        points: DoubleArray = (p_world - self._origin) @ self._rotation
        return points
