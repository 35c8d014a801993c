"""Drawings of occupancy grids, with updates of parts."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from flatland.errors import MapFileError
from flatland.geometry import DoubleArray, Pose
from flatland.node.foreign_topics.poses import matrix_of
from flatland.node.frame_tree import FrameTree
from flatland.web.foreign_topics import Cells, Drawing, Grid

MAX_LENGTH: Final = 4000  # cells of a row or column that are sent
_EXACT: Final = 1e-4  # m, rad; a grid that has moved less is not sent again


class GridDrawer:
    """Draws the latest `nav_msgs/OccupancyGrid` of a topic, and `map_msgs/OccupancyGridUpdate`.

    Attributes:
        note: States that the grid is reduced, if it is.
    """

    def __init__(self) -> None:
        """Creates a drawer without a grid."""
        self.note = ""
        self._grid: Any = None
        self._cells: Cells | None = None
        self._sent: tuple[Pose, float, Cells] | None = None
        self._changed = False

    def receive(self, message: Any, now: int) -> None:  # noqa: ARG002
        """Takes a grid, or an update of a part of the latest grid.

        Raises:
            MapFileError: The number of cells differs from the size, or an update is outside.
        """
        if hasattr(message, "info"):
            info = message.info
            self._grid, self._cells = None, None
            self._cells = _cells(message.data, info.width, info.height)
            self._grid = message
        elif self._cells is not None:
            part = _cells(message.data, message.width, message.height)
            rows = slice(message.y, message.y + message.height)
            columns = slice(message.x, message.x + message.width)
            height, width = self._cells.shape
            if min(message.x, message.y) < 0 or rows.stop > height or columns.stop > width:
                raise MapFileError("an update is outside of the grid")
            self._cells = self._cells.copy()
            self._cells[rows, columns] = part
        self._changed = True

    def draw(self, frames: FrameTree, now: int, *, again: bool) -> Drawing | None:  # noqa: ARG002
        """Returns the grid if its cells or its pose have changed."""
        grid, cells = self._grid, self._cells
        if grid is None or cells is None:
            return None
        frame = frames.to_root(grid.header.frame_id)
        pose = _planar(frame @ matrix_of(grid.info.origin))
        if self._changed or self._sent is None:
            block = math.ceil(max(*cells.shape, 1) / MAX_LENGTH)
            self.note = f"{block} x {block} cells are shown as one" if block > 1 else ""
            self._sent = (pose, grid.info.resolution * block, _reduced(cells, block))
            self._changed = False
        elif not again and max(np.abs(np.subtract(pose, self._sent[0]))) < _EXACT:
            return None
        else:
            self._sent = (pose, *self._sent[1:])
        return Grid(*self._sent)


def _cells(data: Any, width: int, height: int) -> Cells:
    cells = np.asarray(data, np.int8)
    if len(cells) != width * height:
        raise MapFileError(
            f"a grid of {width} x {height} cells must have that number of values, got {len(cells)}"
        )
    return cells.reshape(height, width)


def _reduced(cells: Cells, block: int) -> Cells:
    """Returns the largest value of each block of cells, so that obstacles remain visible."""
    if block == 1:
        return cells
    height, width = (block * math.ceil(length / block) for length in cells.shape)
    padded = np.full((height, width), -1, np.int8)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    reduced: Cells = padded.reshape(height // block, block, width // block, block).max(axis=(1, 3))
    return reduced


def _planar(matrix: DoubleArray) -> Pose:
    x, y = float(matrix[0, 3]), float(matrix[1, 3])
    pose = (x, y, math.atan2(matrix[1, 0], matrix[0, 0]))
    if not all(map(math.isfinite, pose)):
        raise MapFileError("the origin of the grid is not finite")
    return pose
