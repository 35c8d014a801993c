"""Shortest paths of a disc on a grid, by A*."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.geometry import bounds_of
from flatland.scenarios.views import behind

if TYPE_CHECKING:
    from flatland.geometry import BoolArray, DoubleArray, Vector2
    from flatland.physics import PhysicsBody
    from flatland.scenarios.task import Task

_SPACING: Final = 0.1  # of the points of the grid [m], larger only to limit their number
_MAX_POINTS: Final = 1_000_000
_MARGINS: Final = (0.1, 0.05, 0.02)  # distances to obstacles that are tried, in this order [m]
_COMFORT: Final = 0.35  # preferred distance to obstacles [m]
_DISCOMFORT: Final = 2.0  # additional cost of a way without it, relative to its length
_NEAR: Final = 3.0  # largest distance of start and goal to the grid, in spacings
_SIGHT: Final = 0.05  # distance of the samples of a shortcut [m]
_SWEEPS: Final = 50  # over all places of a path that is tightened
_LEAST_GAIN: Final = 1e-5  # of a sweep after which there is another one [m]
_TRISECTIONS: Final = 40  # of an arc
# Largest length of a way on the grid without obstacles, relative to the straight distance.
_MOST_OCTILE: Final = math.hypot(1.0, math.sqrt(2) - 1.0)

Place = tuple["Vector2", float]
"""Center and radius of a place that counts as reached within the radius [m]."""


class PlanningError(Exception):
    """There is no path."""


def plan_path(
    task: Task, start: Vector2, goal: Vector2, *, only_walls: bool = False
) -> DoubleArray:
    """Returns points on a comfortable path, in the world frame [m], shape (n, 2).

    Args:
        task: The robot and its world.
        start: Start of the path [m].
        goal: End of the path [m].
        only_walls: Whether only walls and static models are considered; otherwise, all obstacles
            that the robot collides with, with models at their current poses.

    Raises:
        PlanningError: There is no path.
    """
    grid = _Grid(task, start, [goal], _walls(task) if only_walls else None)
    preferred = grid.free(_COMFORT)
    for margin in _MARGINS:
        path = grid.search(start, goal, grid.free(margin), preferred)
        if path is not None:
            return np.concatenate([path, [goal]])
    raise PlanningError(_no_path(start, goal))


def shortest_length(task: Task, start: Vector2, places: Sequence[Place]) -> float:
    """Returns the length of a shortest path from a start through places in their order [m].

    The path leads to the edge of each place. It is found by A* on the grid, then shortened by
    straight lines between its points; finally, the points at which it reaches the places are moved
    to where the path is shortest. Only walls and static models are considered.

    Args:
        task: The robot and its world.
        start: Start of the path [m].
        places: Centers and radii of the places [m].

    Raises:
        PlanningError: There is no path.
    """
    walls = _walls(task)
    grid = _Grid(task, start, [place for place, _ in places], walls)
    free = grid.free(_MARGINS[-1])
    corners, reached = np.array([start]), [0]
    for center, radius in places:
        here = (float(corners[-1, 0]), float(corners[-1, 1]))
        if math.dist(here, center) > radius:
            path = grid.search(here, center, free, free, radius)
            if path is None:
                raise PlanningError(_no_path(here, center))
            end = _entry(path[-1], None, np.array(center), radius)
            leg = np.concatenate([[here], path, [end]])
            corners = np.concatenate([corners, _shortened(leg, task, walls)[1:]])
        reached.append(len(corners) - 1)
    _tighten(corners, reached[1:], places, task, walls)
    return float(np.hypot(*np.diff(corners, axis=0).T).sum())


def _tighten(
    corners: DoubleArray,
    reached: Sequence[int],
    places: Sequence[Place],
    task: Task,
    walls: list[PhysicsBody],
) -> None:
    """Moves the corners at which a path reaches places, until it becomes no shorter."""
    for _ in range(_SWEEPS):
        gain = 0.0
        for index, (center, radius) in zip(reached, places, strict=True):
            # A corner that reaches several places stays where it is.
            if index == 0 or reached.count(index) > 1:
                continue
            before = corners[index - 1]
            after = corners[index + 1] if index + 1 < len(corners) else None
            ends = [before] if after is None else [before, after]
            new, old = _entry(before, after, np.array(center), radius), corners[index].copy()
            shorter = sum(math.dist(old, end) - math.dist(new, end) for end in ends)
            if shorter > 0 and all(_is_free(end, new, task, walls) for end in ends):
                corners[index] = new
                gain += shorter
        if gain < _LEAST_GAIN:
            return


def _entry(
    before: DoubleArray, after: DoubleArray | None, center: DoubleArray, radius: float
) -> DoubleArray:
    """Returns the point of a circle by which the way from one point to another is shortest.

    Args:
        before: Start of the way [m].
        after: End of the way [m]; None if the way ends in the circle.
        center: Center of the circle [m].
        radius: Its radius [m].
    """
    end = center if after is None else after
    along = end - before
    square = float(along @ along)
    part = float((center - before) @ along) / square if square else 0.0
    nearest: DoubleArray = before + min(max(part, 0.0), 1.0) * along
    if after is None:
        nearest = before
    offset = nearest - center
    if float(np.hypot(*offset)) <= radius:
        return nearest
    if after is None:
        return np.asarray(center + offset * (radius / np.hypot(*offset)))
    # The best point is on the arc between the directions to both ends.
    low = math.atan2(*(before - center)[::-1])
    high = low + math.remainder(math.atan2(*(after - center)[::-1]) - low, math.tau)

    def point(angle: float) -> DoubleArray:
        return center + radius * np.array([math.cos(angle), math.sin(angle)])

    def length(angle: float) -> float:
        return math.dist(before, point(angle)) + math.dist(point(angle), after)

    for _ in range(_TRISECTIONS):
        left, right = (2 * low + high) / 3, (low + 2 * high) / 3
        if length(left) <= length(right):
            high = right
        else:
            low = left
    return point((low + high) / 2)


def _no_path(start: Vector2, goal: Vector2) -> str:
    return (
        f"there is no path from ({start[0]:.2f}, {start[1]:.2f}) to ({goal[0]:.2f}, "
        f"{goal[1]:.2f}) with a distance of {_MARGINS[-1]} m to obstacles"
    )


def _walls(task: Task) -> list[PhysicsBody]:
    world = behind(task.world)
    bodies: list[PhysicsBody] = [layer.body for layer in world.layers]
    for model in world.models:
        bodies += [body for body in model.bodies if body.type == "static"]
    return bodies


def _shortened(path: DoubleArray, task: Task, walls: list[PhysicsBody]) -> DoubleArray:
    """Returns the corners that remain if points are connected by straight lines where possible."""
    kept, current = [0], 0
    while current < len(path) - 1:
        low, high = current + 1, len(path) - 1
        # The visible points of a path around corners are nearly always a contiguous part.
        while low < high:
            middle = (low + high + 1) // 2
            if _is_free(path[current], path[middle], task, walls):
                low = middle
            else:
                high = middle - 1
        current = low
        kept.append(current)
    return path[kept]


def _is_free(a: DoubleArray, b: DoubleArray, task: Task, walls: list[PhysicsBody]) -> bool:
    count = max(2, math.ceil(math.dist(a, b) / _SIGHT) + 1)
    poses = np.zeros((count, 3))
    poses[:, :2] = np.linspace(a, b, count)
    physics = behind(task.world).physics
    free = physics.free_discs(poses, task.radius, task.category_bits, only=walls)
    return bool(free.all())


class _Grid:
    """The points of a square grid over the walls of a world."""

    def __init__(
        self,
        task: Task,
        start: Vector2,
        goals: Sequence[Vector2],
        only: list[PhysicsBody] | None = None,
    ) -> None:
        self._task = task
        self._only = only
        ends = [layer.world_edges.reshape(-1, 2) for layer in task.world.layers]
        corners = np.concatenate([*ends, [start, *goals]])
        x_min, y_min, x_max, y_max = bounds_of(corners) or (*start, *start)
        width, height = x_max - x_min, y_max - y_min
        self._spacing = max(_SPACING, math.sqrt(width * height / _MAX_POINTS))
        # The border is not free, so that the neighbours of all free points exist.
        self._columns, rows = (math.ceil(size / self._spacing) + 3 for size in (width, height))
        xs = x_min + self._spacing * (np.arange(self._columns) - 1)
        ys = y_min + self._spacing * (np.arange(rows) - 1)
        self._shape = (rows, self._columns)
        self._points = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)

    def free(self, margin: float) -> BoolArray:
        """Returns the points at which the robot has a distance to all obstacles, shape (n,)."""
        task = self._task
        poses = np.column_stack((self._points, np.zeros(len(self._points))))
        free = (
            behind(task.world)
            .physics.free_discs(
                poses,
                task.radius + margin,
                task.category_bits,
                ignored=behind(task.robot).bodies,
                only=self._only,
            )
            .reshape(self._shape)
        )
        free[[0, -1], :] = False
        free[:, [0, -1]] = False
        return free.ravel()

    def search(
        self,
        start: Vector2,
        goal: Vector2,
        free: BoolArray,
        preferred: BoolArray,
        radius: float = 0.0,
    ) -> DoubleArray | None:
        """Returns the cheapest path between the free points next to start and goal, shape (n, 2).

        Args:
            start: Start of the path [m].
            goal: End of the path [m].
            free: The points that the path may contain, shape (n,).
            preferred: Those without additional cost, shape (n,).
            radius: Distance to the goal at which the path may end [m].

        Returns:
            The points; None if there is no path.
        """
        first, last = self._nearest(start, free), self._nearest(goal, free)
        ends = self._within(goal, radius, free) or {last}
        if first is None or ends == {None}:
            return None
        if last is None:
            last = min(end for end in ends if end is not None)
        columns, diagonal = self._columns, math.sqrt(2)
        steps = [(1, 1.0), (-1, 1.0), (columns, 1.0), (-columns, 1.0)]
        steps += [(row + column, diagonal) for row in (columns, -columns) for column in (1, -1)]
        weights = np.where(preferred, 1.0, 1.0 + _DISCOMFORT)
        weights[~free] = math.inf
        weight_of = weights.tolist()
        goal_row, goal_column = divmod(last, columns)
        # All ends are that close to the last point.
        slack = _MOST_OCTILE * (2 * radius / self._spacing) if len(ends) > 1 else 0.0
        costs, previous, done = {first: 0.0}, {first: first}, set[int]()
        queue = [(0.0, first)]
        while queue:
            _, point = heapq.heappop(queue)
            if point in ends:
                path: DoubleArray = self._points[_chain(previous, point)]
                return path
            if point in done:
                continue
            done.add(point)
            for step, length in steps:
                neighbour = point + step
                cost = costs[point] + length * weight_of[neighbour]
                if cost < costs.get(neighbour, math.inf):
                    costs[neighbour], previous[neighbour] = cost, point
                    row, column = divmod(neighbour, columns)
                    height, width = abs(row - goal_row), abs(column - goal_column)
                    # The length without obstacles.
                    rest = max(height, width) + (diagonal - 1) * min(height, width)
                    rest = max(rest - slack, 0.0)
                    heapq.heappush(queue, (cost + rest, neighbour))
        return None

    def _within(self, point: Vector2, radius: float, free: BoolArray) -> set[int | None]:
        """Returns the free points of the grid within a radius of a point, none for radius 0."""
        if not radius:
            return set()
        distances = np.hypot(*(self._points - point).T)
        return set(np.flatnonzero((distances <= radius) & free).tolist())

    def _nearest(self, point: Vector2, free: BoolArray) -> int | None:
        distances = np.hypot(*(self._points - point).T)
        distances[~free] = math.inf
        best = int(np.argmin(distances))
        return best if distances[best] <= _NEAR * self._spacing else None


def _chain(previous: dict[int, int], last: int) -> list[int]:
    """Returns the points on the way to the last one."""
    chain = [last]
    while previous[chain[-1]] != chain[-1]:
        chain.append(previous[chain[-1]])
    return chain[::-1]
