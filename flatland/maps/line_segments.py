"""Data files with one line segment per line: `x1 y1 x2 y2`."""

from __future__ import annotations

import errno
import io
import math
import os
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from flatland.config.documents import open_regular
from flatland.errors import MapFileError, Place

_COLUMNS = 4
_MAX_FILE_BYTES = 64 * 1024 * 1024


def read_line_segments(path: str) -> npt.NDArray[np.float64]:
    """Reads all line segments of a file.

    Columns after the fourth, blank lines and lines that start with `#` are ignored.

    Args:
        path: Text file.

    Returns:
        End points (x1, y1, x2, y2) in the units of the file, finite, shape (n, 4).

    Raises:
        OSError: The file cannot be read, or is larger than 64 MiB.
        MapFileError: A line has fewer than four numbers, or a number is NaN or infinite.
    """
    with io.TextIOWrapper(_open(path), encoding="utf-8-sig", errors="replace") as file:
        numbered = [
            (number, line)
            for number, line in enumerate(file, start=1)
            if line.strip() and not line.lstrip().startswith("#")
        ]
    if not numbered:
        return np.empty((0, _COLUMNS))
    try:
        # NumPy is fast, but its errors do not contain the line number in the file.
        lines = [line for _, line in numbered]
        segments = np.loadtxt(lines, comments=None, usecols=range(_COLUMNS), ndmin=2)
        if np.isfinite(segments).all():
            return segments
    except ValueError:
        pass
    return np.array([_parse(line, number, path) for number, line in numbered])


def _open(path: str) -> BinaryIO:
    file = open_regular(path)
    if os.fstat(file.fileno()).st_size > _MAX_FILE_BYTES:
        file.close()
        raise OSError(errno.EFBIG, "it is larger than 64 MiB", path)
    return file


def _parse(line: str, number: int, path: str) -> list[float]:
    try:
        segment = [float(word) for word in line.split(maxsplit=_COLUMNS)[:_COLUMNS]]
    except ValueError:
        segment = []
    if len(segment) < _COLUMNS or not all(math.isfinite(value) for value in segment):
        raise MapFileError(
            f'Failed to read line segment from line {number}, in file "{Path(path).name}"'
            f" [{path}:{number}]",
            place=Place(path, number),
            hint="each line has four numbers, x1 y1 x2 y2; lines that start with # are comments",
        )
    return segment
