"""Extraction of the edges of a layer from the image of a map."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from flatland.geometry import FloatArray
from flatland.maps.grey_image import GreyImage
from flatland.physics import boundary_edges, boundary_loops, dilated, simplified_loop

# A loop that simplification would reduce to fewer points than this stays exact: a small loop, such
# as a pillar or a table leg, would lose its corners or vanish.
_MIN_LOOP_POINTS = 5
_TOLERANCE_PIXELS = 1.0
# The ellipse of 7 x 7 pixels for the morphological opening: row, first and last column.
_OPENING = np.array(
    [(-3, 0, 0), (-2, -2, 2), (-1, -3, 3), (0, -3, 3), (1, -3, 3), (2, -2, 2), (3, 0, 0)], np.int32
)


def lowest_on(occupied_thresh: float) -> int:
    """Returns the smallest grey value that is on, 256 if no value is."""
    return int(np.searchsorted(np.arange(256) / 255.0, occupied_thresh))


def threshold_in_place(image: GreyImage, occupied_thresh: float) -> GreyImage:
    """Sets each pixel to on (1) where value / 255 >= `occupied_thresh`, otherwise to off (0).

    Args:
        image: Grey pixels; overwritten to save the memory of a second large array.
        occupied_thresh: Threshold, 0 to 1.

    Returns:
        The same array.
    """
    np.greater_equal(image, lowest_on(occupied_thresh), out=image.view(np.bool_))
    return image


def image_edges(mask: GreyImage, resolution: float, simplify: int) -> tuple[FloatArray, int]:
    """Returns the edges of a layer.

    Args:
        mask: On (1) and off (0) pixels from the top row to the bottom row, shape (rows, columns).
        resolution: Size of a pixel [m].
        simplify: 0 exact boundary; 1 simplified boundary loops; 2 simplified boundary loops after a
            morphological opening of the on pixels.

    Returns:
        Edges (x1, y1, x2, y2) relative to the lower left corner of the image [m], shape (n, 4), and
        the number of edges without simplification.

    Raises:
        ValueError: The size of the map in metres does not fit a 32-bit float.
    """
    exact = boundary_edges(mask, resolution)
    if simplify == 0:
        return exact, len(exact)
    if simplify == 2:
        eroded = dilated(mask == 0, _OPENING) == 0
        mask = dilated(eroded, _OPENING)
    return _simplified_edges(mask, resolution), len(exact)


def _simplified_edges(mask: GreyImage, resolution: float) -> FloatArray:
    loops = [_simplified_loop(loop) for loop in boundary_loops(mask)]
    if not loops:
        return np.empty((0, 4), np.float32)
    points = np.concatenate(loops)
    ends = np.cumsum([len(loop) for loop in loops])
    successor = np.arange(1, len(points) + 1)
    successor[ends - 1] = np.concatenate(([0], ends[:-1]))
    return (np.hstack((points, points[successor])) * resolution).astype(np.float32)


def _simplified_loop(loop: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    if len(loop) < _MIN_LOOP_POINTS:
        return loop
    kept = simplified_loop(loop, _TOLERANCE_PIXELS)
    return loop if len(kept) < _MIN_LOOP_POINTS else kept
