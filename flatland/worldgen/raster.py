"""Floor plans as grids of cells, in metres."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

FREE: Final = 0
WALL: Final = 1
FURNITURE: Final = 2

Cells = npt.NDArray[np.uint8]


class Rect(NamedTuple):
    """A rectangle along the axes [m]."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float

    @property
    def width(self) -> float:
        """Length along x [m]."""
        return self.x_max - self.x_min

    @property
    def height(self) -> float:
        """Length along y [m]."""
        return self.y_max - self.y_min

    def overlaps(self, other: Rect, margin: float = 0.0) -> bool:
        """Returns whether two rectangles, one of them with a margin [m], have an area in common."""
        return (
            self.x_min < other.x_max + margin
            and other.x_min < self.x_max + margin
            and self.y_min < other.y_max + margin
            and other.y_min < self.y_max + margin
        )


class Raster:
    """A floor plan; (0, 0) is the lower left corner of the lower left cell.

    Attributes:
        resolution: Size of a cell [m].
        cells: `FREE`, `WALL` or `FURNITURE`; shape (rows, columns), the row at the bottom first.
    """

    def __init__(self, size: tuple[float, float], resolution: float, value: int = FREE) -> None:
        """Creates a plan with one value.

        Args:
            size: Width and height [m].
            resolution: Size of a cell [m].
            value: Value of all cells.
        """
        self.resolution = resolution
        columns, rows = (self.index(side) for side in size)
        self.cells: Cells = np.full((rows, columns), value, np.uint8)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        rows, columns = self.cells.shape
        return (columns * self.resolution, rows * self.resolution)

    def index(self, length: float) -> int:
        """Returns the number of cells whose length is nearest to a length [m]."""
        return round(length / self.resolution)

    def snap(self, length: float) -> float:
        """Returns the multiple of the resolution that is nearest to a length [m]."""
        return self.index(length) * self.resolution

    def window(self, rect: Rect) -> tuple[slice, slice]:
        """Returns the rows and columns of a rectangle, cut off at the border of the plan."""
        x_min, y_min, x_max, y_max = (max(self.index(side), 0) for side in rect)
        return slice(y_min, y_max), slice(x_min, x_max)

    def fill(self, rect: Rect, value: int) -> None:
        """Sets all cells of a rectangle."""
        self.cells[self.window(rect)] = value

    def fill_disc(self, x: float, y: float, radius: float, value: int) -> None:
        """Sets all cells whose centres are within a disc."""
        rect = Rect(x - radius, y - radius, x + radius, y + radius)
        rows, columns = self.window(rect)
        part = self.cells[rows, columns]
        height, width = part.shape
        dx = (columns.start + np.arange(width) + 0.5) * self.resolution - x
        dy = (rows.start + np.arange(height) + 0.5) * self.resolution - y
        part[dx[np.newaxis, :] ** 2 + dy[:, np.newaxis] ** 2 <= radius**2] = value
