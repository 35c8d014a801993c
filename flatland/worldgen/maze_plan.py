"""Mazes: passages of equal width between walls along a grid."""

from __future__ import annotations

from typing import Final

import numpy as np

from flatland.worldgen.raster import FREE, WALL, Raster, Rect
from flatland.worldgen.reach import Reach

MIN_SIZE: Final = (6.0, 6.0)  # m
_WALL: Final = 0.2  # m
_PASSAGE: Final = (1.2, 2.0)  # m, least and greatest width
_LOOPS: Final = (0.1, 0.5)  # fraction of dead ends that are opened
_ROOM_AREA: Final = 90.0  # passages per room

Place = tuple[int, int]


def draw_maze(raster: Raster, _reach: Reach, radius: float, rng: np.random.Generator) -> None:
    """Draws a maze into an empty plan.

    A depth-first search connects all places of a grid by a tree of passages. Then some of the dead
    ends are opened, so that there is more than one way, and a few walls are removed to form rooms.

    Args:
        raster: The plan.
        _reach: Not required: the passages are wide enough.
        radius: Radius of the disc that reaches all of the maze [m].
        rng: Random numbers.
    """
    raster.fill(Rect(0, 0, *raster.size), WALL)
    width, height = raster.size
    wall = max(raster.snap(_WALL), raster.resolution)
    pitch = max(rng.uniform(*_PASSAGE), 2 * radius + 0.3) + wall
    # The first and last walls are as thick as the others.
    columns, rows = (max(2, round((side - wall) / pitch)) for side in (width, height))
    maze = _Maze(columns, rows, rng)
    maze.carve()
    maze.open_dead_ends(float(rng.uniform(*_LOOPS)))
    maze.add_rooms(round(columns * rows / _ROOM_AREA))
    xs = [raster.snap(wall + (width - wall) * i / columns) for i in range(columns + 1)]
    ys = [raster.snap(wall + (height - wall) * i / rows) for i in range(rows + 1)]
    for column, row in maze.places():
        x_min, y_min = xs[column], ys[row]
        x_max, y_max = xs[column + 1] - wall, ys[row + 1] - wall
        raster.fill(Rect(x_min, y_min, x_max, y_max), FREE)
        if maze.is_open((column, row), (column + 1, row)):
            raster.fill(Rect(x_max, y_min, x_max + wall, y_max), FREE)
        if maze.is_open((column, row), (column, row + 1)):
            raster.fill(Rect(x_min, y_max, x_max, y_max + wall), FREE)
    for column, row in maze.free_corners():
        x, y = xs[column + 1] - wall, ys[row + 1] - wall
        raster.fill(Rect(x, y, x + wall, y + wall), FREE)


class _Maze:
    """A grid of places, with the openings between neighbours."""

    def __init__(self, columns: int, rows: int, rng: np.random.Generator) -> None:
        self._columns, self._rows, self._rng = columns, rows, rng
        self._open: set[tuple[Place, Place]] = set()

    def places(self) -> list[Place]:
        """Returns all places."""
        return [(column, row) for row in range(self._rows) for column in range(self._columns)]

    def is_open(self, a: Place, b: Place) -> bool:
        """Returns whether there is no wall between two neighbours."""
        return (min(a, b), max(a, b)) in self._open

    def carve(self) -> None:
        """Connects all places by a tree."""
        start = (int(self._rng.integers(self._columns)), int(self._rng.integers(self._rows)))
        visited, path = {start}, [start]
        # Passages that rarely turn are long, as in a real maze.
        straightness = self._rng.uniform(0.0, 0.6)
        direction = (1, 0)
        while path:
            here = path[-1]
            new = [place for place in self._neighbours(here) if place not in visited]
            if not new:
                path.pop()
                continue
            ahead = (here[0] + direction[0], here[1] + direction[1])
            if ahead in new and self._rng.random() < straightness:
                there = ahead
            else:
                there = new[int(self._rng.integers(len(new)))]
            direction = (there[0] - here[0], there[1] - here[1])
            self._connect(here, there)
            visited.add(there)
            path.append(there)

    def open_dead_ends(self, fraction: float) -> None:
        """Removes one more wall at a fraction of the dead ends."""
        for place in self.places():
            neighbours = self._neighbours(place)
            closed = [other for other in neighbours if not self.is_open(place, other)]
            is_dead_end = len(neighbours) - len(closed) == 1
            if is_dead_end and closed and self._rng.random() < fraction:
                self._connect(place, closed[int(self._rng.integers(len(closed)))])

    def add_rooms(self, count: int) -> None:
        """Removes the walls within rectangles of two or three places."""
        for _ in range(count):
            width, height = (int(n) for n in self._rng.integers(2, 4, 2))
            if width > self._columns or height > self._rows:
                continue
            first_column = int(self._rng.integers(self._columns - width + 1))
            first_row = int(self._rng.integers(self._rows - height + 1))
            for column in range(first_column, first_column + width):
                for row in range(first_row, first_row + height):
                    if column + 1 < first_column + width:
                        self._connect((column, row), (column + 1, row))
                    if row + 1 < first_row + height:
                        self._connect((column, row), (column, row + 1))

    def free_corners(self) -> list[Place]:
        """Returns the places at whose upper right corner no wall ends."""
        return [
            (c, r)
            for c, r in self.places()
            if self.is_open((c, r), (c + 1, r))
            and self.is_open((c, r + 1), (c + 1, r + 1))
            and self.is_open((c, r), (c, r + 1))
            and self.is_open((c + 1, r), (c + 1, r + 1))
        ]

    def _connect(self, a: Place, b: Place) -> None:
        self._open.add((min(a, b), max(a, b)))

    def _neighbours(self, place: Place) -> list[Place]:
        column, row = place
        around = ((column - 1, row), (column + 1, row), (column, row - 1), (column, row + 1))
        return [(c, r) for c, r in around if 0 <= c < self._columns and 0 <= r < self._rows]
