"""Whether a disc reaches every free place of a floor plan.

The cells decide it conservatively: where a disc may fit anywhere in a cell, one that is slightly
larger must have a connected way of cells nearby.
"""

from __future__ import annotations

import importlib
from typing import Any, Final

import numpy as np

from flatland.geometry import BoolArray
from flatland.worldgen.raster import FREE, FURNITURE, Cells

_HALF_DIAGONAL: Final = 0.7072  # of a cell, in cells
_SLACK: Final = 3  # cells between a place where the disc may fit and one where it is sure to fit
_MAX_ROUNDS: Final = 20


class Reach:
    """Examines floor plans of one resolution for discs of one radius."""

    def __init__(self, radius: float, resolution: float) -> None:
        """Prepares the shapes.

        Args:
            radius: Radius of the disc [m].
            resolution: Size of a cell [m].
        """
        self._cv2: Any = importlib.import_module("cv2")
        self._resolution = resolution
        cells = radius / resolution
        self._sure = _disc(cells + _HALF_DIAGONAL)
        self._possible = _disc(max(cells - _HALF_DIAGONAL, 0.0))
        self._covered = _disc(cells + 1.0)
        self._near = np.ones((2 * _SLACK + 1, 2 * _SLACK + 1), np.uint8)

    def unreachable(self, cells: Cells) -> BoolArray:
        """Returns the places of the disc's centre that may be free, but are not reached.

        Args:
            cells: The plan; everything outside it is occupied.
        """
        occupied = _with_border(cells)
        main = _largest_region(self._cv2, self._places(occupied, self._sure))
        return self._beyond(occupied, main)[1:-1, 1:-1]

    def is_connected(self, cells: Cells) -> bool:
        """Returns whether the disc reaches each place of a plan where it fits, and there is one."""
        occupied = _with_border(cells)
        main = _largest_region(self._cv2, self._places(occupied, self._sure))
        return bool(main.any()) and not self._beyond(occupied, main).any()

    def places(self, cells: Cells) -> BoolArray:
        """Returns the cells anywhere in which the disc's centre may be, in the largest region."""
        main = _largest_region(self._cv2, self._places(_with_border(cells), self._sure))
        return np.asarray(main[1:-1, 1:-1] > 0)

    def seal(self, cells: Cells) -> None:
        """Fills what the disc cannot reach, so that each place where it fits is reached."""
        for _ in range(_MAX_ROUNDS):
            lost = self.unreachable(cells)
            if not lost.any():
                break
            around = self._cv2.dilate(lost.astype(np.uint8), self._covered)
            cells[(around > 0) & (cells == FREE)] = FURNITURE
        self._fill_pockets(cells)

    def fill_gaps(self, cells: Cells, width: float) -> None:
        """Fills gaps between obstacles that are narrower than a width [m]."""
        side = max(round(width / self._resolution), 1)
        square, last = np.ones((side, side), np.uint8), side - 1
        free = np.pad((cells == FREE).astype(np.uint8), side)
        # Opposite anchors: otherwise, a square with an even side would shift the result.
        free = self._cv2.erode(free, square, anchor=(0, 0))
        wide = self._cv2.dilate(free, square, anchor=(last, last))[side:-side, side:-side]
        cells[(wide == 0) & (cells == FREE)] = FURNITURE

    def _fill_pockets(self, cells: Cells) -> None:
        """Fills free cells without a connection to the largest free region."""
        main = _largest_region(self._cv2, (cells == FREE).astype(np.uint8))
        cells[(main == 0) & (cells == FREE)] = FURNITURE

    def _beyond(self, occupied: Cells, main: Cells) -> BoolArray:
        """Returns the places where the disc may fit, but that are not close to a region."""
        reached = self._cv2.dilate(main, self._near)
        possible = self._places(occupied, self._possible)
        return np.asarray((possible > 0) & (reached == 0))

    def _places(self, occupied: Cells, disc: Cells) -> Cells:
        """Returns 1 for the cells around which a disc covers nothing that is occupied, else 0."""
        grown = self._cv2.dilate(occupied, disc, borderType=self._cv2.BORDER_REPLICATE)
        return np.asarray(1 - grown, np.uint8)


def _with_border(cells: Cells) -> Cells:
    """Returns 1 for occupied cells and for a border around them, else 0."""
    return np.pad((cells != FREE).astype(np.uint8), 1, constant_values=1)


def _disc(radius: float) -> Cells:
    """Returns the cells that a disc around the centre of a cell touches; radius in cells."""
    reach = int(radius + 0.5)
    offset = np.maximum(np.abs(np.arange(-reach, reach + 1)) - 0.5, 0.0)
    touched = offset[:, np.newaxis] ** 2 + offset[np.newaxis, :] ** 2 < max(radius, 1e-9) ** 2
    return np.asarray(touched, np.uint8)


def _largest_region(cv2: Any, mask: Cells) -> Cells:
    """Returns the largest region of a mask that is connected along the sides of cells.

    Regions are filled one after the other: `connectedComponents` uses threads, which take longer
    than the work for a room.
    """
    columns = mask.shape[1]
    rest = mask.copy()
    left = int(np.count_nonzero(mask))
    largest, seed = 0, (0, 0)
    while left > largest:
        row, column = divmod(int(rest.argmax()), columns)
        size = int(cv2.floodFill(rest, None, (column, row), 0, flags=4)[0])
        left -= size
        if size > largest:
            largest, seed = size, (column, row)
    region = mask.copy()
    if largest:
        cv2.floodFill(region, None, seed, 2, flags=4)
    return np.asarray(region == 2, np.uint8)
