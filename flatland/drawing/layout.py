"""Mapping of a view of the world to the pixels of an image."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from flatland.drawing.capture import Box, Scene

_LONGEST_SIDE: Final = 20_000  # pixels; matplotlib ends at 65 536
_ROOM: Final = (13.0, 9.0)  # inches that a picture without a size may take
_NARROWEST: Final = 2.0  # inches that it takes at least
_MARGINS: Final = (0.62, 0.48, 0.24, 0.2)  # inches left, below, right and above, with axes
_CHARACTERS: Final = 4  # of a number at the y axis, that the left margin has room for
_CHARACTER: Final = 0.09  # inches for each one more
_PADDING: Final = 0.02  # of the longer side of what is there
_FARTHEST, _NEAREST = 1e9, 1e-3  # m; coordinates, and sides of a view
_EMPTY_VIEW: Final = (-5.0, -5.0, 5.0, 5.0)  # m


def checked_view(view: Sequence[float]) -> Box:
    """Converts a view to four floats.

    Raises:
        ValueError: There are not four numbers, or they are out of range.
    """
    try:
        x_min, y_min, x_max, y_max = (float(number) for number in view)
    except (TypeError, ValueError):
        raise ValueError(
            f"view must be four numbers (x_min, y_min, x_max, y_max), got {view!r}"
        ) from None
    numbers = (x_min, y_min, x_max, y_max)
    is_near = all(abs(number) <= _FARTHEST for number in numbers)  # and no NaN
    if not (is_near and x_max - x_min >= _NEAREST and y_max - y_min >= _NEAREST):
        raise ValueError(
            f"view must be within +-{_FARTHEST:g} m, with x_min < x_max and y_min < y_max, at "
            f"least {_NEAREST:g} m apart, got {numbers}"
        )
    return numbers


def whole_view(scene: Scene) -> Box:
    """Returns a view with all that is there."""
    box = scene.box()
    if box is None:
        return _EMPTY_VIEW
    x_min, y_min, x_max, y_max = box
    # Something small alone, such as a robot without a map, keeps space around it.
    pad = max(_PADDING * max(x_max - x_min, y_max - y_min), 0.25)
    return (x_min - pad, y_min - pad, x_max + pad, y_max + pad)


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the world is on the picture.

    Attributes:
        size: Of the picture [pixels].
        frame: Left, bottom, width and height of the part that shows the world, from the lower
            left corner of the picture [pixels].
        view: What is in the frame, of the frame's shape [m].
        has_axes: Whether there are axes around it.
    """

    size: tuple[int, int]
    frame: tuple[int, int, int, int]
    view: Box
    has_axes: bool

    @classmethod
    def make(cls, size: tuple[int, int] | None, dpi: float, view: Box, axes: bool) -> Layout:
        """Lays a picture out; see `draw` for the arguments.

        Raises:
            ValueError: The size is out of its range, or too small for the axes.
        """
        layout = cls._make(size, dpi, view, axes, 0.0)
        more = _longest_number(layout.view[1], layout.view[3]) - _CHARACTERS
        return cls._make(size, dpi, view, axes, more * _CHARACTER) if axes and more > 0 else layout

    @classmethod
    def _make(
        cls, size: tuple[int, int] | None, dpi: float, view: Box, axes: bool, more_left: float
    ) -> Layout:
        """Lays a picture out with some inches more at the left."""
        left, below, right, above = (round(m * dpi) if axes else 0 for m in _MARGINS)
        left += round(more_left * dpi)
        x_min, y_min, x_max, y_max = view
        width, height = x_max - x_min, y_max - y_min
        if size is None:
            scale = min(_ROOM[0] / width, _ROOM[1] / height) * dpi  # pixels a metre
            sides = [round(max(side * scale, _NARROWEST * dpi)) for side in (width, height)]
            size = (sides[0] + left + right, sides[1] + below + above)
        columns, rows = _checked_size(size)
        frame = (left, below, columns - left - right, rows - below - above)
        if min(frame[2:]) < 1:
            raise ValueError(
                f"size {columns} x {rows} leaves no room beside the axes at {dpi:g} dpi"
            )
        scale = min(frame[2] / width, frame[3] / height)
        x, y = (x_min + x_max) / 2, (y_min + y_max) / 2
        dx, dy = frame[2] / scale / 2, frame[3] / scale / 2
        return cls((columns, rows), frame, (x - dx, y - dy, x + dx, y + dy), axes)

    @property
    def scale(self) -> float:
        """Pixels a metre."""
        return self.frame[2] / (self.view[2] - self.view[0])


def _longest_number(low: float, high: float) -> int:
    """Returns how many characters the numbers at an axis have at most [m]."""
    # matplotlib makes 10 steps at most, of 1, 2, 2.5, 5 times a power of ten.
    decimals = min(max(0, 1 - math.floor(math.log10((high - low) / 10))), 4)
    return max(len(f"{number:.{decimals}f}") for number in (low, high))


def _checked_size(size: tuple[int, int]) -> tuple[int, int]:
    try:
        columns, rows = size
        whole = (int(columns), int(rows))
    except (TypeError, ValueError):
        raise ValueError(f"size must be (width, height) in pixels, got {size!r}") from None
    if whole != (columns, rows) or not all(1 <= side <= _LONGEST_SIDE for side in whole):
        raise ValueError(
            f"size must be whole numbers of pixels from 1 to {_LONGEST_SIDE}, got {size!r}"
        )
    return whole
