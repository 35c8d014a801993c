"""Maps of layers that are given as occupancy grids."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from flatland.errors import MapFileError, Place
from flatland.geometry import finite_pose
from flatland.maps.map_file import LayerMap
from flatland.maps.map_image import image_edges
from flatland.values import OccupancyGrid

OCCUPIED_FROM: Final = 65
"""Least occupancy of a wall, as in map files with `occupied_thresh: 0.65`."""


def grid_map(grid: OccupancyGrid, simplify: int) -> LayerMap:
    """Returns the geometry of a grid: the boundaries between occupied cells and all others.

    As in map files, unknown cells and everything outside the grid are free.

    Args:
        grid: The grid.
        simplify: As for `flatland.maps.map_file.load_map`.

    Raises:
        MapFileError: The grid has no cells, or a number is invalid.
    """
    cells = np.asarray(grid.cells)
    if cells.ndim != 2 or not cells.size:
        raise MapFileError(f"a grid must have cells, shape (rows, columns), got {cells.shape}")
    if cells.dtype.kind not in "iu":
        raise MapFileError(f"the cells of a grid must be integers, got {cells.dtype}")
    if not 0 < grid.resolution < math.inf:
        raise MapFileError(
            f"the resolution of a grid must be positive and finite [m], got {grid.resolution}"
        )
    try:
        origin = finite_pose(grid.origin)
        # The top row first, as in an image.
        mask = np.ascontiguousarray(cells[::-1] < OCCUPIED_FROM).view(np.uint8)
        edges, exact_edge_count = image_edges(mask, grid.resolution, simplify)
    except ValueError as error:
        raise MapFileError(f"invalid grid, {error}") from error
    return LayerMap(origin, edges, exact_edge_count, "", (), Place(""))
