"""Boundaries between the on and off pixels of a bitmap.

All pixels outside the bitmap are on. The corners of pixels have integer coordinates: x counts
columns from the left edge, y counts rows upwards from the bottom edge. Multiplied by the
resolution, they are coordinates in the frame of the body of a layer.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from flatland import _core
from flatland.geometry import FloatArray

Mask = npt.NDArray[np.bool_] | npt.NDArray[np.uint8]


def boundary_edges(mask: Mask, resolution: float) -> FloatArray:
    """Returns the exact boundary as straight edges.

    Each edge is a maximal straight run between pixels that differ, horizontal between two rows or
    vertical between two columns. A run continues through a corner at which only diagonally
    adjacent pixels are equal.

    Args:
        mask: Pixels with the top row first, on where non-zero; shape (rows, columns), bool or
            uint8.
        resolution: Size of a pixel [m].

    Returns:
        Edges (x1, y1, x2, y2) relative to the lower left corner of the bitmap [m], shape (n, 4).
        The order depends only on the bitmap.

    Raises:
        ValueError: The mask has a wrong shape or type, or the resolution is not positive, or a
            coordinate is outside the range of a 32-bit float.
    """
    return _core.boundary_edges(mask, resolution)


def boundary_loops(mask: Mask) -> list[npt.NDArray[np.int32]]:
    """Returns the exact boundary as closed loops.

    On pixels lie to the left of a loop. Two on pixels are connected only through a common side, so
    at a corner where four sides of the boundary meet, the sides of each on pixel belong together.

    Args:
        mask: Pixels with the top row first, on where non-zero; shape (rows, columns), bool or
            uint8.

    Returns:
        For each loop, the pixel corners (x, y) at which it turns, shape (k, 2) with k even and at
        least 4, starting at its topmost, then leftmost corner. The loops are sorted by their first
        corners, from the top.

    Raises:
        ValueError: The mask has a wrong shape or type.
    """
    points, starts = _core.boundary_loops(mask)
    return [points[start:end] for start, end in pairwise(starts)]
