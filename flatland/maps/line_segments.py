"""Data files with one line segment per line: `x1 y1 x2 y2`."""

from __future__ import annotations

import io
import math
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from flatland.config.files import read_regular
from flatland.config.foreign_files import foreign_file
from flatland.errors import MapFileError, Place

_COLUMNS = 4


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
    text = read_regular(path).decode("utf-8-sig", "replace")
    numbered = [
        (number, line)
        for number, line in enumerate(io.StringIO(text, newline=None), start=1)
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


def _hint(line: str) -> str:
    """Returns a hint for a line that is not a segment."""
    if re.search(r"[,;]", line):
        return "numbers are separated by spaces, not by commas"
    foreign = foreign_file(line.encode("utf-8", "replace"))
    form = "each line has four numbers, x1 y1 x2 y2; lines that start with # are comments"
    return f"{foreign}; {form}" if foreign else form


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
            hint=_hint(line),
        )
    return segment
