"""Detection of line segments along the walls of a bitmap.

Coordinates are in pixels from the top left corner of the image, x to the right, y down: the pixel
in column c and row r covers c <= x <= c + 1 and r <= y <= r + 1.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from flatland.extras import require
from flatland.geometry import DoubleArray

Mask = npt.NDArray[np.bool_]

# Parameters of the line segment detector, except for the image scale.
_SIGMA_SCALE = 1.0
_QUANT = 1.0
_ANGLE_TOLERANCE = 22.5  # deg
_LOG_EPS = 1.0
_DENSITY = 0.8

_PADDING = 8
"""Width of a border around the image [pixels]; the detector finds no lines close to the edge."""
_TOLERANCE = 0.95
"""Largest distance of a segment from the walls [pixels]; less than 1 to allow for rounding."""
_SAMPLES_PER_PIXEL = 4
_SEARCH_RADIUS = 2
"""Largest distance at which a wall is found [pixels]."""
_MIN_LENGTH = 1.0
"""A trimmed segment that is shorter is a rounded corner and not a wall [pixels]."""


class WallBoundary:
    """Boundary between on and off pixels, with nearest-point queries."""

    def __init__(self, mask: Mask) -> None:
        """Finds the boundary.

        Args:
            mask: On and off pixels, shape (rows, columns); pixels outside the mask are on.
        """
        padded = np.pad(mask, 1, constant_values=True)
        # Entry (k, i) of _along_x: whether y = k is a boundary from x = i to i + 1.
        # Entry (k, i) of _along_y: whether x = k is a boundary from y = i to i + 1.
        self._along_x = (padded[1:] != padded[:-1])[:, 1:-1]
        self._along_y = (padded[:, 1:] != padded[:, :-1])[1:-1].T

    def offsets(self, points: DoubleArray) -> DoubleArray:
        """Returns the offset of the nearest wall from each point.

        Args:
            points: Points [pixels], shape (n, 2).

        Returns:
            Offsets [pixels], shape (n, 2); infinite if no wall is within the search radius.
        """
        best = np.full(points.shape, np.inf)
        distance = np.full(len(points), np.inf)
        for boundary, along in ((self._along_x, 0), (self._along_y, 1)):
            cell = np.floor(points).astype(np.int64)
            for across in range(1 - _SEARCH_RADIUS, _SEARCH_RADIUS + 1):
                for ahead in range(-_SEARCH_RADIUS, _SEARCH_RADIUS + 1):
                    k, i = cell[:, 1 - along] + across, cell[:, along] + ahead
                    inside = (k >= 0) & (k < boundary.shape[0]) & (i >= 0) & (i < boundary.shape[1])
                    is_boundary = np.zeros(len(points), bool)
                    is_boundary[inside] = boundary[k[inside], i[inside]]
                    offset = np.empty(points.shape)
                    offset[:, along] = np.clip(points[:, along], i, i + 1) - points[:, along]
                    offset[:, 1 - along] = k - points[:, 1 - along]
                    length = np.hypot(offset[:, 0], offset[:, 1])
                    nearer = is_boundary & (length < distance) & (length <= _SEARCH_RADIUS)
                    best[nearer] = offset[nearer]
                    distance[nearer] = length[nearer]
        return best


def find_wall_segments(mask: Mask, image_scale: float) -> DoubleArray:
    """Finds line segments that lie within one pixel of the walls of a map.

    The detector smooths the image, which thickens thin walls, and extends lines beyond corners.
    Therefore, each segment is shifted perpendicularly onto its wall, trimmed at both ends, and bent
    where it leaves the wall in between.

    Args:
        mask: On and off pixels, shape (rows, columns); pixels outside the mask are on.
        image_scale: Factor by which the detector enlarges the image; a larger factor finds smaller
            features.

    Returns:
        Segments (x1, y1, x2, y2) [pixels], shape (n, 4).
    """
    boundary = WallBoundary(mask)
    lines = [_sample(segment[:2], segment[2:]) for segment in _detect(mask, image_scale)]
    for improve in (_shift, _trim, _bend, _keep_on_wall):
        offsets = _offsets_of(lines, boundary)
        lines = [
            better
            for line, offset in zip(lines, offsets, strict=True)
            for better in improve(line, offset)
        ]
    return np.array([[*line[0], *line[-1]] for line in lines]).reshape(-1, 4)


def _detect(mask: Mask, image_scale: float) -> DoubleArray:
    image = np.where(np.pad(mask, _PADDING, constant_values=True), 255, 0).astype(np.uint8)
    cv2 = require("cv2", "the detection of line segments needs")
    detector = cv2.createLineSegmentDetector(
        cv2.LSD_REFINE_STD,
        image_scale,
        _SIGMA_SCALE,
        _QUANT,
        _ANGLE_TOLERANCE,
        _LOG_EPS,
        _DENSITY,
    )
    lines = detector.detect(image)[0]
    if lines is None:
        return np.empty((0, 4))
    # The detector divides the coordinates of pixel centres by the scale, which shifts them by half
    # a pixel of the enlarged image.
    segments: DoubleArray = lines.reshape(-1, 4).astype(np.float64) + 0.5 / image_scale - _PADDING
    return segments


def _sample(start: DoubleArray, end: DoubleArray) -> DoubleArray:
    """Returns points along a segment, including both ends, shape (k, 2)."""
    count = max(2, int(np.hypot(*(end - start)) * _SAMPLES_PER_PIXEL) + 1)
    return np.linspace(start, end, count)


def _offsets_of(lines: list[DoubleArray], boundary: WallBoundary) -> list[DoubleArray]:
    """Returns the offsets of the points of each line, computed in one call."""
    if not lines:
        return []
    ends = np.cumsum([len(line) for line in lines])
    return np.split(boundary.offsets(np.concatenate(lines)), ends[:-1])


def _shift(line: DoubleArray, offsets: DoubleArray) -> Iterator[DoubleArray]:
    """Shifts a line perpendicularly by the median of its distances from the wall."""
    along = line[-1] - line[0]
    normal = np.array([-along[1], along[0]]) / np.hypot(*along)
    near = np.isfinite(offsets[:, 0])
    if near.any():
        yield line + np.median(offsets[near] @ normal) * normal


def _trim(line: DoubleArray, offsets: DoubleArray) -> Iterator[DoubleArray]:
    """Removes the parts at both ends that are off the wall."""
    on_wall = np.flatnonzero(np.hypot(offsets[:, 0], offsets[:, 1]) <= _TOLERANCE)
    if len(on_wall):
        rest = line[on_wall[0] : on_wall[-1] + 1]
        if np.hypot(*(rest[-1] - rest[0])) >= _MIN_LENGTH:
            yield rest


def _bend(line: DoubleArray, offsets: DoubleArray) -> Iterator[DoubleArray]:
    """Splits a line where it leaves the wall, and connects the parts along the wall."""
    distances = np.hypot(offsets[:, 0], offsets[:, 1])
    begin = 0
    for run in _runs(distances > _TOLERANCE):
        yield line[begin : run.start]
        worst = run.start + int(distances[run].argmax())
        if np.isfinite(distances[worst]):
            corner = line[worst] + offsets[worst]
            yield _sample(line[run.start - 1], corner)
            yield _sample(corner, line[run.stop])
        begin = run.stop
    yield line[begin:]


def _keep_on_wall(line: DoubleArray, offsets: DoubleArray) -> Iterator[DoubleArray]:
    """Removes the remaining parts that are off the wall."""
    for run in _runs(np.hypot(offsets[:, 0], offsets[:, 1]) <= _TOLERANCE):
        if run.stop - run.start > 1:
            yield line[run]


def _runs(flags: npt.NDArray[np.bool_]) -> Iterator[slice]:
    """Yields the runs of consecutive flags that are set."""
    changes = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    for first, stop in changes.reshape(-1, 2).tolist():
        yield slice(first, stop)
