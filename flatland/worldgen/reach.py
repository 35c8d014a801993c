"""Whether a disc reaches every free place of a floor plan.

The decision is conservative: near each cell in which the disc may fit, a slightly larger disc must
have a connected way of cells.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import BoolArray
from flatland.physics import connected_regions, dilated
from flatland.worldgen.raster import FREE, FURNITURE, Cells

_HALF_DIAGONAL: Final = 0.7072  # of a cell, in cells
_SLACK: Final = 3  # cells between a place where the disc may fit and a place where it must fit
_MAX_ROUNDS: Final = 20

# The cells of a shape as horizontal runs: row, first and last column, relative to its center.
Shape = npt.NDArray[np.int32]


class Reach:
    """Examines floor plans of one resolution for discs of one radius."""

    def __init__(self, radius: float, resolution: float) -> None:
        """Prepares the shapes.

        Args:
            radius: Radius of the disc [m].
            resolution: Size of a cell [m].
        """
        self._resolution = resolution
        cells = radius / resolution
        self._sure = _disc(cells + _HALF_DIAGONAL)
        self._possible = _disc(max(cells - _HALF_DIAGONAL, 0.0))
        self._covered = _disc(cells + 1.0)
        self._near = _square(-_SLACK, _SLACK)

    def unreachable(self, cells: Cells) -> BoolArray:
        """Returns the places of the disc's centre that may be free, but are not reached.

        Args:
            cells: The plan; everything outside it is occupied.
        """
        return self._beyond(cells, self.places(cells))

    def is_connected(self, cells: Cells) -> bool:
        """Returns whether the disc fits somewhere, and reaches each place where it fits."""
        main = self.places(cells)
        return bool(main.any()) and not self._beyond(cells, main).any()

    def places(self, cells: Cells) -> BoolArray:
        """Returns the cells anywhere in which the disc's centre may be, in the largest region."""
        return _largest_region(_places(cells, self._sure))

    def seal(self, cells: Cells) -> None:
        """Fills the places that the disc cannot reach, so that all remaining ones are reached."""
        for _ in range(_MAX_ROUNDS):
            lost = self.unreachable(cells)
            if not lost.any():
                break
            around = dilated(lost, self._covered)
            cells[(around > 0) & (cells == FREE)] = FURNITURE
        self._fill_pockets(cells)

    def fill_gaps(self, cells: Cells, width: float) -> None:
        """Fills gaps between obstacles that are narrower than a width [m]."""
        side = max(round(width / self._resolution), 1)
        # The squares of free cells, by their upper left cells, then all cells of these squares.
        narrow = dilated(cells != FREE, _square(0, side - 1), outside=True)
        wide = dilated(narrow == 0, _square(1 - side, 0))
        cells[(wide == 0) & (cells == FREE)] = FURNITURE

    def _fill_pockets(self, cells: Cells) -> None:
        """Fills free cells without a connection to the largest free region."""
        main = _largest_region(cells == FREE)
        cells[~main & (cells == FREE)] = FURNITURE

    def _beyond(self, cells: Cells, main: BoolArray) -> BoolArray:
        """Returns the places where the disc may fit, but that are not close to a region."""
        reached = dilated(main, self._near)
        return np.asarray(_places(cells, self._possible) & (reached == 0))


def _places(cells: Cells, disc: Shape) -> BoolArray:
    """Returns the cells around which a disc covers nothing that is occupied."""
    return np.asarray(dilated(cells != FREE, disc, outside=True) == 0)


def _square(first: int, last: int) -> Shape:
    """Returns the square of these rows and columns."""
    return np.array([(row, first, last) for row in range(first, last + 1)], np.int32)


def _disc(radius: float) -> Shape:
    """Returns the cells that a disc around the centre of a cell touches; radius in cells."""
    reach = int(radius + 0.5)
    rows = np.arange(-reach, reach + 1)
    offset = np.maximum(np.abs(rows) - 0.5, 0.0)
    touched = offset[:, np.newaxis] ** 2 + offset[np.newaxis, :] ** 2 < max(radius, 1e-9) ** 2
    half = touched.sum(axis=1) // 2
    runs: Shape = np.stack((rows, -half, half), axis=1)[touched.any(axis=1)].astype(np.int32)
    return runs


def _largest_region(mask: BoolArray) -> BoolArray:
    """Returns the largest region of a mask that is connected along the sides of cells.

    Of several largest regions, it is the first one, row by row.
    """
    regions = connected_regions(mask, diagonally=False)
    sizes = np.bincount(regions.ravel())
    sizes[0] = 0
    return np.asarray(mask & (regions == sizes.argmax()))
