"""From a bitmap to the boundary between its on and off pixels.

Everything outside the bitmap is on. Corners of pixels have integer coordinates: x counts columns
from the left edge, y counts rows upwards from the bottom edge; times the resolution that is the
frame of a layer's body.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from flatland import _core
from flatland.geometry import FloatArray

Mask = npt.NDArray[np.bool_] | npt.NDArray[np.uint8]


def boundary_edges(mask: Mask, resolution: float) -> FloatArray:
    """Finds the exact boundary as straight edges.

    Each edge is a maximal run of flipped pixels, horizontal between two rows or vertical between
    two columns. A run goes on through a corner where only diagonal neighbours are equal.

    Args:
        mask: Pixels, the top row first, non-zero is on; shape (rows, columns), bool or uint8.
        resolution: Size of a pixel [m].

    Returns:
        Edges (x1, y1, x2, y2) [m], origin at the bitmap's lower left corner, shape (n, 4). The
        order depends on the bitmap alone.

    Raises:
        ValueError: The mask's shape or type is wrong, or the resolution is not positive or so
            large or small that a coordinate does not fit a 32-bit float.
    """
    return _core.boundary_edges(mask, resolution)


def boundary_loops(mask: Mask) -> list[npt.NDArray[np.int32]]:
    """Finds the exact boundary as closed loops.

    On pixels lie to the left of a loop; they are connected by their sides only, so where four
    pieces of boundary meet in a corner each of the two on pixels keeps its own two sides.

    Args:
        mask: Pixels, the top row first, non-zero is on; shape (rows, columns), bool or uint8.

    Returns:
        One array of pixel corners (x, y) a loop, shape (k, 2), k even and at least 4: the corners
        where it turns, from its topmost, then leftmost one. Loops come in the order of that
        corner, from the top.

    Raises:
        ValueError: The mask's shape or type is wrong.
    """
    points, starts = _core.boundary_loops(mask)
    return [points[start:end] for start, end in pairwise(starts)]
