"""Drawings of runs in a terminal, of Braille characters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Final

from flatland.scenarios.episode import Result
from flatland.scenarios.outline import Line

_BLANK: Final = 0x2800
# Bit of each dot of a Braille character, by row and column.
_BITS: Final = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))


def sketch(result: Result, walls: Sequence[Line], columns: int = 76, rows: int = 24) -> str:
    """Returns a drawing of a run: walls and models as lines, the path as `•` from `S` to `X`.

    Goals are `G`. Models are drawn at their poses at the end.

    Args:
        result: The run.
        walls: Walls of its world.
        columns: Most characters of a line.
        rows: Most lines.
    """
    tracks = result.tracks
    path = [point for track in tracks for point in track]
    models = [(role, line) for _, role, lines in result.models for line in lines]
    points = [point for line in walls for point in line] + path + list(result.goals)
    # Models may have been put far away.
    points += [point for role, line in models if role == "hit" or not walls for point in line]
    if not points:
        return ""
    x_min, x_max = min(x for x, _ in points), max(x for x, _ in points)
    y_min, y_max = min(y for _, y in points), max(y for _, y in points)
    # Two dots per column and four per row have the same distance.
    wide, high = 2 * columns - 1, 4 * rows - 1
    scale = min(wide / max(x_max - x_min, 1e-6), high / max(y_max - y_min, 1e-6))

    def place(point: tuple[float, float]) -> tuple[int, int]:
        return round((point[0] - x_min) * scale), round((y_max - point[1]) * scale)

    last_column, last_row = place((x_max, y_min))
    grid = [[" "] * (last_column // 2 + 1) for _ in range(last_row // 4 + 1)]
    seen = [
        line
        for role, line in models
        if role != "robot" and all(x_min <= x <= x_max and y_min <= y <= y_max for x, y in line)
    ]
    for line in [*walls, *seen]:
        for x, y in _dots([place(point) for point in line]):
            old = grid[y // 4][x // 2]
            bits = ord(old) if old != " " else _BLANK
            grid[y // 4][x // 2] = chr(bits | _BITS[y % 4][x % 2])
    for track in tracks:
        for x, y in _dots([place(point) for point in track]):
            grid[y // 4][x // 2] = "•"
    marks = [("G", goal) for goal in result.goals]
    marks += [("S", path[0]), ("X", path[-1])] if path else []
    for mark, point in marks:
        x, y = place(point)
        grid[y // 4][x // 2] = mark
    return "\n".join("".join(line).rstrip() for line in grid)


def _dots(corners: Sequence[tuple[int, int]]) -> Iterable[tuple[int, int]]:
    for (x1, y1), (x2, y2) in itertools.pairwise(corners):
        count = max(abs(x2 - x1), abs(y2 - y1), 1)
        for index in range(count + 1):
            part = index / count
            yield math.floor(x1 + part * (x2 - x1) + 0.5), math.floor(y1 + part * (y2 - y1) + 0.5)
