"""Shapes in three dimensions, as messages describe them, and their projection onto the plane."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import MAX_MAGNITUDE, DoubleArray
from flatland.web.foreign_topics import Colors, Marks

Color = Sequence[float]
"""(r, g, b, a), each from 0 to 1."""

OWN_COLOR: Final = (0.0, 0.0, 0.0, 0.0)
"""Stands for the colour that the page uses for the topic."""
MAX_LINES: Final = 50_000
MAX_TRIANGLES: Final = 50_000
MAX_TEXTS: Final = 1000
_MAX_TEXT: Final = 200  # characters

_SIDES: Final = 24  # of a cylinder
_HEAD_SHARE: Final = 0.23  # of the length of an arrow, as in RViz


class Shapes:
    """Lines, triangles, arrows and texts in one frame."""

    __slots__ = (
        "_arrow_colors",
        "_arrows",
        "_closed",
        "_line_colors",
        "_lines",
        "_texts",
        "_triangle_colors",
        "_triangles",
    )

    def __init__(self) -> None:
        """Creates an object without shapes."""
        self._lines: list[DoubleArray] = []  # of shape (n, 7): two points, width
        self._line_colors: list[Colors] = []
        self._triangles: list[DoubleArray] = []  # of shape (n, 9)
        self._triangle_colors: list[Colors] = []
        self._closed: list[npt.NDArray[np.bool_]] = []
        self._arrows: list[DoubleArray] = []  # of shape (n, 9): two points, widths, head length
        self._arrow_colors: list[Colors] = []
        self._texts: list[tuple[DoubleArray, str]] = []

    def add_lines(
        self, starts: DoubleArray, ends: DoubleArray, width: float, colors: Colors
    ) -> None:
        """Adds lines, or discs where the ends of a line coincide.

        Args:
            starts: Start of each line [m], shape (n, 3).
            ends: Its end, same shape.
            width: Width [m]; 0 for thin lines.
            colors: Colour of each line, shape (n, 4).
        """
        widths = np.full((len(starts), 1), limited(width))
        self._lines.append(np.hstack((starts, ends, widths)))
        self._line_colors.append(colors)

    def add_triangles(self, corners: DoubleArray, colors: Colors, *, closed: bool = False) -> None:
        """Adds triangles.

        Args:
            corners: Three corners of each triangle [m], shape (n, 3, 3).
            colors: Colour of each triangle, shape (n, 4).
            closed: Whether they are the surface of a convex solid, counter-clockwise as seen from
                outside; then, only those that face upwards are drawn.
        """
        self._triangles.append(corners.reshape(-1, 9))
        self._triangle_colors.append(colors)
        self._closed.append(np.full(len(corners), closed))

    def add_arrows(
        self, starts: DoubleArray, ends: DoubleArray, sizes: Sequence[float], colors: Colors
    ) -> None:
        """Adds arrows.

        Args:
            starts: Start of each arrow [m], shape (n, 3).
            ends: Its tip, same shape.
            sizes: Width of the shaft, width of the head and length of the head [m]; a head length
                of 0 stands for a part of the length of the arrow.
            colors: Colour of each arrow, shape (n, 4).
        """
        self._arrows.append(np.hstack((starts, ends, np.tile(limited(sizes), (len(starts), 1)))))
        self._arrow_colors.append(colors)

    def extend(self, other: Shapes) -> None:
        """Adds the shapes of another object, which are in the same frame."""
        for name in self.__slots__:
            getattr(self, name).extend(getattr(other, name))

    def add_text(self, position: DoubleArray, text: str) -> None:
        """Adds a text, whose lines are joined.

        Args:
            position: Its position [m], shape (3,).
            text: The text.
        """
        self._texts.append((position, " ".join(text.split())[:_MAX_TEXT]))

    def moved(self, matrix: DoubleArray) -> Shapes:
        """Returns the shapes in another frame.

        Args:
            matrix: Transform to this frame, shape (4, 4).
        """
        moved = Shapes()
        moved.extend(self)
        for rows, points in ((moved._lines, 2), (moved._triangles, 3), (moved._arrows, 2)):
            for i, part in enumerate(rows):
                placed = transformed(matrix, part[:, : 3 * points].reshape(-1, 3))
                rows[i] = np.hstack((placed.reshape(-1, 3 * points), part[:, 3 * points :]))
        moved._texts = [(transformed(matrix, p), text) for p, text in moved._texts]
        return moved

    def projected(self, matrix: DoubleArray) -> Marks:
        """Returns the shapes as seen from above.

        Shapes with numbers that are not finite are omitted, and those beyond the limits.

        Args:
            matrix: Transform to the world frame, shape (4, 4).
        """
        arrow_lines, arrow_triangles = self._projected_arrows(matrix)
        arrow_colors = _stack_colors(self._arrow_colors)
        lines = _stack(self._lines, 7)
        flat_lines = np.hstack((_planar(matrix, lines[:, :6]), lines[:, 6:]))
        triangles, triangle_colors = self._projected_triangles(matrix)
        all_lines, line_colors = _finite(
            np.vstack((flat_lines, arrow_lines)),
            np.vstack((_stack_colors(self._line_colors), arrow_colors)),
        )
        all_triangles, all_triangle_colors = _finite(
            np.vstack((triangles, arrow_triangles)), np.vstack((triangle_colors, arrow_colors))
        )
        return Marks(
            all_lines[:MAX_LINES].astype(np.float32),
            line_colors[:MAX_LINES],
            all_triangles[:MAX_TRIANGLES].astype(np.float32),
            all_triangle_colors[:MAX_TRIANGLES],
            self._projected_texts(matrix),
        )

    def _projected_triangles(self, matrix: DoubleArray) -> tuple[DoubleArray, Colors]:
        flat = _planar(matrix, _stack(self._triangles, 9))
        colors = _stack_colors(self._triangle_colors)
        if not self._closed:
            return flat, colors
        a, b, c = flat[:, 0:2], flat[:, 2:4], flat[:, 4:6]
        u, v = b - a, c - a
        faces_up = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0
        kept = faces_up | ~np.concatenate(self._closed)
        return flat[kept], colors[kept]

    def _projected_arrows(self, matrix: DoubleArray) -> tuple[DoubleArray, DoubleArray]:
        """Returns the shafts as lines, shape (n, 5), and the heads as triangles, shape (n, 6)."""
        arrows = _stack(self._arrows, 9)
        ends = _planar(matrix, arrows[:, :6])
        start, tip = ends[:, 0:2], ends[:, 2:4]
        along = tip - start
        length = np.linalg.norm(along, axis=1, keepdims=True)
        unit = along / np.maximum(length, 1e-9)
        shaft, width, head = arrows[:, 6:7], arrows[:, 7:8], arrows[:, 8:9]
        head = np.minimum(np.where(head > 0, head, _HEAD_SHARE * length), length)
        base = tip - head * unit
        side = 0.5 * width * np.column_stack((-unit[:, 1], unit[:, 0]))
        return np.hstack((start, base, shaft)), np.hstack((base + side, base - side, tip))

    def _projected_texts(self, matrix: DoubleArray) -> list[tuple[float, float, str]]:
        texts = self._texts[:MAX_TEXTS]
        points = _planar(matrix, np.array([p for p, _ in texts], float).reshape(-1, 3)).tolist()
        return [
            (x, y, text)
            for (x, y), (_, text) in zip(points, texts, strict=True)
            if np.isfinite((x, y)).all()
        ]


def colors_of(color: Color, count: int) -> Colors:
    """Returns a colour several times, shape (count, 4)."""
    return np.tile(packed_colors([color]), (count, 1))


def packed_colors(colors: npt.ArrayLike) -> Colors:
    """Returns colours of floats from 0 to 1, shape (n, 4), as bytes."""
    values = np.nan_to_num(np.asarray(colors, float).reshape(-1, 4))
    packed: Colors = np.rint(255 * np.clip(values, 0, 1)).astype(np.uint8)
    return packed


def transformed(matrix: DoubleArray, points: npt.ArrayLike) -> DoubleArray:
    """Returns points, shape (..., 3), transformed by a matrix of shape (4, 4).

    Numbers that are not finite, or too large for the world, become NaN.
    """
    result: DoubleArray = limited(points) @ matrix[:3, :3].T + matrix[:3, 3]
    return result


def limited(values: npt.ArrayLike) -> DoubleArray:
    """Returns numbers, of which those that are not finite or too large are replaced by NaN.

    Unlike infinities, NaN results in no warnings of numpy.
    """
    numbers = np.asarray(values, float)
    return np.where(np.abs(numbers) <= MAX_MAGNITUDE, numbers, np.nan)


def _unit_box() -> DoubleArray:
    """Returns the surface of a cube of length 1 around the origin, shape (12, 3, 3)."""
    square = np.array(((-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)), float) / 2
    faces = []
    for axis in range(3):
        for sign in (0.5, -0.5):
            face = np.insert(square, axis, sign, axis=1)
            # Inserting the y axis mirrors the square.
            outwards = (sign > 0) != (axis == 1)
            faces.append(face if outwards else face[::-1])
    return np.array(faces).reshape(12, 3, 3)


def _unit_cylinder() -> DoubleArray:
    """Returns the surface of an upright cylinder of diameter and height 1, shape (n, 3, 3)."""
    angles = np.linspace(0, 2 * np.pi, _SIDES + 1)
    ring = np.column_stack((np.cos(angles), np.sin(angles))) / 2
    triangles = []
    for p, q in itertools.pairwise(ring):
        p_up, q_up, p_down, q_down = (*p, 0.5), (*q, 0.5), (*p, -0.5), (*q, -0.5)
        triangles += [
            ((0, 0, 0.5), p_up, q_up),
            ((0, 0, -0.5), q_down, p_down),
            (p_down, q_down, q_up),
            (p_down, q_up, p_up),
        ]
    return np.array(triangles, float)


UNIT_BOX: Final = _unit_box()
UNIT_CYLINDER: Final = _unit_cylinder()


def _planar(matrix: DoubleArray, rows: DoubleArray) -> DoubleArray:
    """Transforms the points of rows of shape (n, 3 k) and drops their heights: (n, 2 k)."""
    count = rows.shape[1] // 3
    points = transformed(matrix, rows.reshape(-1, 3))
    planar: DoubleArray = points[:, :2].reshape(-1, 2 * count)
    return planar


def _stack(parts: list[DoubleArray], columns: int) -> DoubleArray:
    return np.vstack(parts) if parts else np.zeros((0, columns))


def _stack_colors(parts: list[Colors]) -> Colors:
    return np.vstack(parts) if parts else np.zeros((0, 4), np.uint8)


def _finite(rows: DoubleArray, colors: Colors) -> tuple[DoubleArray, Colors]:
    kept = np.isfinite(rows).all(axis=1)
    return rows[kept], colors[kept]
