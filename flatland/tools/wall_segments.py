"""Line segments along the walls of a bitmap, for maps whose pixel boundary has too many edges.

All coordinates are in pixels from the image's top left corner, x to the right, y down: pixel
(column c, row r) covers c to c + 1 and r to r + 1.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from flatland.geometry import DoubleArray

Mask = npt.NDArray[np.bool_]

# Parameters of the line segment detector; the image scale is the caller's choice.
_SIGMA_SCALE = 1.0
_QUANTISATION = 1.0
_ANGLE_TOLERANCE = 22.5  # deg
_LOG_EPS = 1.0
_DENSITY = 0.8

_PADDING = 8
"""Pixels of outside put around the image: the detector is blind close to the rim of its input."""
_TOLERANCE = 0.95
"""How far a segment may be from the walls; below 1 so that rounding keeps it within a pixel."""
_SAMPLES_PER_PIXEL = 4
_REACH = 2
"""How far the walls are looked for, in pixels."""
_SHORTEST = 1.0
"""A segment that is shorter once its ends are cut is a rounded corner, no wall."""


class WallBoundary:
    """The steps between on and off pixels, asked for the nearest point on them."""

    def __init__(self, mask: Mask) -> None:
        """Finds the steps.

        Args:
            mask: On and off pixels, shape (rows, columns); outside is on.
        """
        padded = np.pad(mask, 1, constant_values=True)
        # Entry (k, i): a step along y = k from x = i to i + 1; and along x = k from y = i.
        self._along_x = (padded[1:] != padded[:-1])[:, 1:-1]
        self._along_y = (padded[:, 1:] != padded[:, :-1])[1:-1].T

    def offsets(self, points: DoubleArray) -> DoubleArray:
        """Returns the way from each point to the nearest wall.

        Args:
            points: Shape (n, 2).

        Returns:
            Vectors, shape (n, 2); infinite where no wall is within two pixels.
        """
        best = np.full(points.shape, np.inf)
        distance = np.full(len(points), np.inf)
        for steps, along in ((self._along_x, 0), (self._along_y, 1)):
            cell = np.floor(points).astype(np.int64)
            for across in range(1 - _REACH, _REACH + 1):
                for ahead in range(-_REACH, _REACH + 1):
                    k, i = cell[:, 1 - along] + across, cell[:, along] + ahead
                    inside = (k >= 0) & (k < steps.shape[0]) & (i >= 0) & (i < steps.shape[1])
                    is_step = np.zeros(len(points), bool)
                    is_step[inside] = steps[k[inside], i[inside]]
                    way = np.empty(points.shape)
                    way[:, along] = np.clip(points[:, along], i, i + 1) - points[:, along]
                    way[:, 1 - along] = k - points[:, 1 - along]
                    length = np.hypot(way[:, 0], way[:, 1])
                    nearer = is_step & (length < distance) & (length <= _REACH)
                    best[nearer] = way[nearer]
                    distance[nearer] = length[nearer]
        return best


def find_wall_segments(mask: Mask, image_scale: float) -> DoubleArray:
    """Finds segments that lie on the walls of a map within a pixel.

    The detector smooths the image, so that thin walls come out too thick, and it runs on a little
    at corners. So each segment is moved sideways onto its wall, its ends are cut, and it is bent
    where it leaves the wall in between.

    Args:
        mask: On and off pixels, shape (rows, columns); outside is on.
        image_scale: By how much the detector enlarges the image; more finds smaller features.

    Returns:
        Segments (x1, y1, x2, y2), shape (n, 4).
    """
    boundary = WallBoundary(mask)
    lines = [_sample(segment[:2], segment[2:]) for segment in _detect(mask, image_scale)]
    for improve in (_shift, _cut, _bend, _keep_on_wall):
        ways = _offsets_of(lines, boundary)
        lines = [
            better for line, way in zip(lines, ways, strict=True) for better in improve(line, way)
        ]
    return np.array([[*line[0], *line[-1]] for line in lines]).reshape(-1, 4)


def _detect(mask: Mask, image_scale: float) -> DoubleArray:
    image = np.where(np.pad(mask, _PADDING, constant_values=True), 255, 0).astype(np.uint8)
    detector = cv2.createLineSegmentDetector(
        cv2.LSD_REFINE_STD,
        image_scale,
        _SIGMA_SCALE,
        _QUANTISATION,
        _ANGLE_TOLERANCE,
        _LOG_EPS,
        _DENSITY,
    )
    lines = detector.detect(image)[0]
    if lines is None:
        return np.empty((0, 4))
    # The detector divides coordinates of pixel centres by the scale, which moves them by half a
    # pixel of the enlarged image.
    segments: DoubleArray = lines.reshape(-1, 4).astype(np.float64) + 0.5 / image_scale - _PADDING
    return segments


def _sample(start: DoubleArray, end: DoubleArray) -> DoubleArray:
    """Makes a line: points along a straight segment, shape (k, 2), ends included."""
    count = max(2, int(np.hypot(*(end - start)) * _SAMPLES_PER_PIXEL) + 1)
    return np.linspace(start, end, count)


def _offsets_of(lines: list[DoubleArray], boundary: WallBoundary) -> list[DoubleArray]:
    """Asks for the offsets of all lines at once."""
    if not lines:
        return []
    ends = np.cumsum([len(line) for line in lines])
    return np.split(boundary.offsets(np.concatenate(lines)), ends[:-1])


def _shift(line: DoubleArray, ways: DoubleArray) -> Iterator[DoubleArray]:
    """Moves a line sideways by the median of its points' distances from the wall."""
    along = line[-1] - line[0]
    normal = np.array([-along[1], along[0]]) / np.hypot(*along)
    near = np.isfinite(ways[:, 0])
    if near.any():
        yield line + np.median(ways[near] @ normal) * normal


def _cut(line: DoubleArray, ways: DoubleArray) -> Iterator[DoubleArray]:
    """Takes the ends away that lie off the wall."""
    on_wall = np.flatnonzero(np.hypot(ways[:, 0], ways[:, 1]) <= _TOLERANCE)
    if len(on_wall):
        rest = line[on_wall[0] : on_wall[-1] + 1]
        if np.hypot(*(rest[-1] - rest[0])) >= _SHORTEST:
            yield rest


def _bend(line: DoubleArray, ways: DoubleArray) -> Iterator[DoubleArray]:
    """Breaks a line whose ends are on the wall where it leaves it, and leads it round there."""
    distances = np.hypot(ways[:, 0], ways[:, 1])
    begin = 0
    for run in _runs(distances > _TOLERANCE):
        yield line[begin : run.start]
        worst = run.start + int(distances[run].argmax())
        if np.isfinite(distances[worst]):
            corner = line[worst] + ways[worst]
            yield _sample(line[run.start - 1], corner)
            yield _sample(corner, line[run.stop])
        begin = run.stop
    yield line[begin:]


def _keep_on_wall(line: DoubleArray, ways: DoubleArray) -> Iterator[DoubleArray]:
    """Takes away what still lies off the wall."""
    for run in _runs(np.hypot(ways[:, 0], ways[:, 1]) <= _TOLERANCE):
        if run.stop - run.start > 1:
            yield line[run]


def _runs(flags: npt.NDArray[np.bool_]) -> Iterator[slice]:
    """Finds where flags are set one after the other."""
    changes = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    for first, stop in changes.reshape(-1, 2).tolist():
        yield slice(first, stop)
