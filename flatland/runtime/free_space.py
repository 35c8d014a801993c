"""The free space between walls on a grid, for a disc, with its connected regions."""

from __future__ import annotations

import functools
import logging
import math
from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.errors import WorldError
from flatland.geometry import BoolArray, Bounds, DoubleArray
from flatland.physics import are_connected, connected_regions, distances_to_off

_LOG = logging.getLogger("flatland")

IntArray = npt.NDArray[np.int64]

_CELLS_PER_RADIUS: Final = 4.0
_MIN_CELL_SIZE: Final = 0.02  # m
_MAX_CELL_SIZE: Final = 0.05  # m, exceeded only to limit the number of cells, with a warning
_MAX_CELLS: Final = 16_000_000
_OUTSIDE: Final = -1  # number of the region around the rectangle


class FreeSpace:
    """A rectangle of square cells with their distances to the nearest wall.

    Distances on the grid are estimates. Decisions based on them are either conservative or
    confirmed by an exact test.
    """

    def __init__(
        self,
        walls: DoubleArray,
        bounds: Bounds,
        radius: float,
        clearance: float,
        fits: Callable[[DoubleArray, float], BoolArray],
        *,
        cell: float | None = None,
    ) -> None:
        """Creates the grid.

        Args:
            walls: Edges (x1, y1, x2, y2) in the world frame [m], shape (n, 4).
            bounds: (x_min, y_min, x_max, y_max) of the rectangle in the world frame [m].
            radius: Radius of the disc [m], positive.
            clearance: Minimum distance of a placed disc to the walls [m].
            fits: The exact test: returns for centers, shape (n, 2), and a radius which discs
                overlap no wall, shape (n,).
            cell: Width of a cell, at least the `least_cell` of the bounds [m]; None for one that
                depends on the radius.
        """
        x_min, y_min, x_max, y_max = bounds
        width, height = x_max - x_min, y_max - y_min
        self._radius = radius
        self._fits = fits
        self._x, self._y = float(x_min), float(y_min)
        self._origin = np.array([x_min, y_min])
        self._extent = np.array([width, height])
        if cell is None:
            cell = min(max(radius / _CELLS_PER_RADIUS, _MIN_CELL_SIZE), _MAX_CELL_SIZE)
        self._cell = max(cell, _limit_of_cells(width, height))
        if self._cell > cell:
            self._warn_of_wide_cells(cell)
        self._columns = max(1, math.ceil(width / self._cell))
        self._rows = max(1, math.ceil(height / self._cell))
        # Walls outside the bounds matter as far as a disc within the bounds reaches them.
        margin = math.ceil((radius + clearance) / self._cell) + 2
        distances = self._distances(walls, margin)
        # A wall may be one cell closer or farther than estimated, and a place up to 0.71 cells from
        # the center of its cell.
        slack = (1.0 + math.sqrt(0.5)) * self._cell
        self._candidates: IntArray = np.flatnonzero(distances >= radius + clearance - slack)
        self._regions = self._connected(distances)

    def _warn_of_wide_cells(self, cell: float) -> None:
        half = self._cell * math.sqrt(0.5)
        _LOG.warning(
            "free places in %.6g m x %.6g m: cells are %.3g m wide instead of %.3g m, since their "
            "number is limited to %d; a disc of radius %.3g m may not find its way through gaps "
            "of less than %.3g m: use smaller bounds or maps",
            *self._extent,
            self._cell,
            cell,
            _MAX_CELLS,
            self._radius,
            2 * (math.hypot(self._radius, half) + half),
        )

    def cells(self, connected_to: tuple[float, float] | None) -> IntArray:
        """Returns the cells that may contain a place for the disc, shape (n,).

        Args:
            connected_to: Point in the world frame [m] from which the disc must be able to reach the
                cells; None for no such condition.

        Raises:
            WorldError: The point is out of bounds, or the disc does not fit there.
        """
        if connected_to is None:
            return self._candidates
        reached = self._regions_around(np.array(connected_to))
        return self._candidates[np.isin(self._regions[self._candidates], reached)]

    def largest_region(self) -> IntArray:
        """Returns the cells of the largest connected region, as `cells` does."""
        regions = self._regions[self._candidates]
        sizes = np.bincount(regions[regions > 0], minlength=1)
        largest = sizes.argmax() if sizes.any() else -1
        cells: IntArray = self._candidates[regions == largest]
        return cells

    def regions_of(self, cells: IntArray) -> frozenset[int]:
        """Returns the numbers of the connected regions of cells."""
        return self._with_outside(self._regions[cells])

    def regions_at(self, x: float, y: float) -> frozenset[int]:
        """Returns the numbers of the connected regions to which a point belongs.

        All surroundings of the rectangle are connected, and belong to the regions at its border.

        Args:
            x: Position in the world frame [m], may be out of bounds.
            y: Position in the world frame [m].
        """
        column, row = ((np.array((x, y)) - self._origin) / self._cell).tolist()
        if not (0 <= column <= self._columns and 0 <= row <= self._rows):
            return self._outside
        # There is no wall on the way to the center of a cell in which the disc fits.
        reach = max(self._radius / self._cell, math.sqrt(2))
        first_column, first_row = (max(math.floor(i - reach), 0) for i in (column, row))
        last_column, last_row = (math.ceil(i + reach) for i in (column, row))
        grid = self._regions.reshape(self._rows, self._columns)
        window = grid[first_row:last_row, first_column:last_column]
        rows, columns = np.indices(window.shape)
        squared = (columns + (first_column + 0.5 - column)) ** 2
        squared += (rows + (first_row + 0.5 - row)) ** 2
        return self._with_outside(window[squared <= reach * reach])

    @functools.cached_property
    def _outside(self) -> frozenset[int]:
        """The numbers of the regions at the border, and that of the surroundings."""
        grid = self._regions.reshape(self._rows, self._columns)
        border = np.concatenate((grid[0], grid[-1], grid[:, 0], grid[:, -1]))
        return frozenset(np.unique(border).tolist()) - {0} | {_OUTSIDE}

    def _with_outside(self, regions: npt.NDArray[np.int32]) -> frozenset[int]:
        found = frozenset(np.unique(regions).tolist()) - {0}
        return found | self._outside if found & self._outside else found

    def distance_to(self, regions: frozenset[int], x: float, y: float) -> float:
        """Returns the distance from a point to some connected regions [m], to within a cell.

        Args:
            regions: Numbers of the regions.
            x: Position in the world frame [m], may be out of bounds.
            y: Position in the world frame [m].

        Returns:
            The distance to the nearest center of a cell in which the disc fits; infinite if there
            is none; 0 for a point outside of the rectangle if its surroundings are a region.
        """
        if _OUTSIDE in regions and self.cell_at(x, y) is None:
            return 0.0
        cells = np.flatnonzero(np.isin(self._regions, list(regions)))
        offsets = self._centers(cells) - (x, y)
        return float(np.hypot(*offsets.T).min(initial=math.inf))

    def is_outside(self, regions: frozenset[int]) -> bool:
        """Returns whether the surroundings of the rectangle are one of some regions."""
        return _OUTSIDE in regions

    @property
    def size(self) -> int:
        """Number of cells."""
        return self._rows * self._columns

    def cell_at(self, x: float, y: float) -> int | None:
        """Returns the cell of a point in the world frame [m], None out of bounds."""
        column = math.floor((x - self._x) / self._cell)
        row = math.floor((y - self._y) / self._cell)
        if not (0 <= column < self._columns and 0 <= row < self._rows):
            return None
        return row * self._columns + column

    def is_connected_within(
        self, start: tuple[float, float], goal: tuple[float, float], margin: float
    ) -> bool:
        """Returns whether a path of the disc connects two points without a wide detour.

        Args:
            start: A point in the world frame [m].
            goal: Another point.
            margin: Distance by which the path may leave the rectangle whose opposite corners are
                the points [m].
        """
        # Without arrays, which take longer for two points.
        (x_min, x_max), (y_min, y_max) = sorted((start[0], goal[0])), sorted((start[1], goal[1]))
        cells = self.cell_at(*start), self.cell_at(*goal)
        if cells[0] is None or cells[1] is None:
            return False
        first_column = math.floor((x_min - margin - self._x) / self._cell)
        first_row = math.floor((y_min - margin - self._y) / self._cell)
        last_column = math.floor((x_max + margin - self._x) / self._cell)
        last_row = math.floor((y_max + margin - self._y) / self._cell)
        return are_connected(
            self._passable,
            divmod(cells[0], self._columns),
            divmod(cells[1], self._columns),
            (max(first_row, 0), max(first_column, 0)),
            (min(last_row, self._rows - 1), min(last_column, self._columns - 1)),
        )

    @functools.cached_property
    def _passable(self) -> BoolArray:
        """Whether the disc fits around the center of each cell, shape (rows, columns)."""
        return self._regions.reshape(self._rows, self._columns) > 0

    def point_in(self, cell: int, u: float, v: float) -> tuple[float, float]:
        """Returns a point of a cell in the world frame [m].

        Args:
            cell: The cell.
            u: Position along x within the cell, from 0 to 1.
            v: Position along y within the cell, from 0 to 1.
        """
        row, column = divmod(cell, self._columns)
        width, height = self._extent.tolist()
        x = min((column + u) * self._cell, width)
        y = min((row + v) * self._cell, height)
        return (self._x + x, self._y + y)

    def places_in(self, cells: IntArray, rng: np.random.Generator) -> DoubleArray:
        """Returns a random point of each cell in the world frame [m], shape (n, 2)."""
        corners = np.stack((cells % self._columns, cells // self._columns), axis=1)
        inside = (corners + rng.random((len(cells), 2))) * self._cell
        # The last row and column may extend beyond the rectangle.
        places: DoubleArray = self._origin + np.minimum(inside, self._extent)
        return places

    def _centers(self, cells: IntArray) -> DoubleArray:
        corners = np.stack((cells % self._columns, cells // self._columns), axis=1)
        centers: DoubleArray = self._origin + (corners + 0.5) * self._cell
        return centers

    def _distances(self, walls: DoubleArray, margin: int) -> DoubleArray:
        """Returns the distances of the centers of the cells to the nearest wall, to within a cell.

        Args:
            walls: Edges (x1, y1, x2, y2) in the world frame [m], shape (n, 4).
            margin: Width of the border around the grid whose walls are included, in cells.

        Returns:
            The distances [m] row by row, shape (rows * columns,); infinite without any wall.
        """
        shape = (self._rows + 2 * margin, self._columns + 2 * margin)
        ends = (walls.reshape(-1, 2, 2) - self._origin) / self._cell + margin
        points = _points_on(ends, np.array([shape[1], shape[0]]))
        cells = np.minimum(points.astype(np.int64), np.array([shape[1], shape[0]]) - 1)
        empty = np.ones(shape, np.uint8)
        empty[cells[:, 1], cells[:, 0]] = 0
        distances = distances_to_off(empty)
        inner = distances[margin : margin + self._rows, margin : margin + self._columns]
        result: DoubleArray = inner.ravel() * np.float32(self._cell)
        return result

    def _connected(self, distances: DoubleArray) -> npt.NDArray[np.int32]:
        """Returns for each cell the number of its connected region, 0 if the disc does not fit.

        If two centers at a distance L have at least the distance sqrt(r² + L² / 4) to all walls,
        all points between them have at least the distance r. Here L is the diagonal of a cell.
        """
        least = math.hypot(self._radius, self._cell * math.sqrt(0.5))
        passable = distances >= least + self._cell
        undecided = np.flatnonzero((distances >= least - self._cell) & ~passable)
        passable[undecided] = self._fits(self._centers(undecided), least)
        grid = passable.reshape(self._rows, self._columns)
        return connected_regions(grid, diagonally=True).ravel()

    def _regions_around(self, point: DoubleArray) -> npt.NDArray[np.int32]:
        where = f"connected_to ({point[0]:g}, {point[1]:g})"
        if not ((point >= self._origin) & (point <= self._origin + self._extent)).all():
            raise WorldError(f"{where} is out of bounds")
        if not self._fits(point[np.newaxis], self._radius)[0]:
            raise WorldError(f"{where} is not free for a disc of radius {self._radius:g} m")
        column, row = ((point - self._origin) / self._cell).astype(np.int64).tolist()
        columns = np.clip(np.arange(column - 1, column + 2), 0, self._columns - 1)
        rows = np.clip(np.arange(row - 1, row + 2), 0, self._rows - 1)
        around: IntArray = np.unique(rows[:, np.newaxis] * self._columns + columns)
        near = np.hypot(*(self._centers(around) - point).T) <= math.sqrt(2) * self._cell
        regions: npt.NDArray[np.int32] = np.unique(self._regions[around[near]])
        return np.trim_zeros(regions)


def least_cell(bounds: Bounds) -> float:
    """Returns the least width of a cell that limits the number of cells of a rectangle [m]."""
    x_min, y_min, x_max, y_max = bounds
    return max(_MIN_CELL_SIZE, _limit_of_cells(x_max - x_min, y_max - y_min))


def _limit_of_cells(width: float, height: float) -> float:
    return max(math.sqrt(width * height / _MAX_CELLS), max(width, height) / _MAX_CELLS)


class Spread:
    """A set of places with a minimum distance from each other.

    Attributes:
        places: The places (x, y) [m] in the order in which they were added.
    """

    def __init__(self, distance: float) -> None:
        """Creates an empty set.

        Args:
            distance: Minimum distance between two places [m], positive.
        """
        self.places: list[tuple[float, float]] = []
        self._distance = distance
        # Places by square cells of that width: places within the distance are in adjacent cells.
        self._cells: dict[tuple[int, int], list[tuple[float, float]]] = {}

    def fill(self, candidates: DoubleArray, n: int) -> bool:
        """Adds, in order, the candidates whose distance from all places is sufficient.

        Args:
            candidates: Points (x, y) [m], shape (m, 2).
            n: Number of places at which no more are added.

        Returns:
            Whether the set has `n` places.
        """
        for x, y in candidates.tolist():
            if len(self.places) == n:
                break
            column, row = math.floor(x / self._distance), math.floor(y / self._distance)
            if not self._is_near(x, y, column, row):
                self.places.append((x, y))
                self._cells.setdefault((column, row), []).append((x, y))
        return len(self.places) == n

    def _is_near(self, x: float, y: float, column: int, row: int) -> bool:
        for i in (column, column - 1, column + 1):
            for j in (row, row - 1, row + 1):
                for other_x, other_y in self._cells.get((i, j), ()):
                    if math.hypot(other_x - x, other_y - y) < self._distance:
                        return True
        return False


def _points_on(ends: DoubleArray, size: IntArray) -> DoubleArray:
    """Returns points at most half a unit apart on the parts of edges that lie in a rectangle.

    Edges on the border of the rectangle may be left out.

    Args:
        ends: Both ends of each edge, shape (n, 2, 2).
        size: Width and height of the rectangle, which starts at the origin.

    Returns:
        The points, shape (m, 2).
    """
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    # The part of each edge, from 0 to 1, between the two lines that bound each axis: infinite or
    # empty if the edge is parallel to them, NaN if it lies on one of them.
    with np.errstate(divide="ignore", invalid="ignore"):
        crossings = np.stack((-start / along, (size - start) / along))
        enter, leave = crossings.min(axis=0), crossings.max(axis=0)
    first = np.maximum(enter.max(axis=1), 0.0)
    last = np.minimum(leave.min(axis=1), 1.0)
    kept = first <= last
    start, along, first, last = start[kept], along[kept], first[kept], last[kept]
    lengths = np.hypot(along[:, 0], along[:, 1]) * (last - first)
    counts = np.ceil(2 * lengths).astype(np.int64) + 1
    edge = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    fraction = first[edge] + (last - first)[edge] * number / np.maximum(counts[edge] - 1, 1)
    points: DoubleArray = np.clip(start[edge] + along[edge] * fraction[:, np.newaxis], 0, size)
    return points
