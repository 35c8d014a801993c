"""Mapping of a view of the world to the pixels of an image."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from flatland.checks import plain_numbers, shown
from flatland.drawing.footprints import scene_bounds
from flatland.geometry import Bounds
from flatland.scene.world_scene import Scene

_MAX_SIDE: Final = 20_000  # pixels; the limit of matplotlib is 65 536
_DEFAULT_AREA: Final = (13.0, 9.0)  # inches; largest view of an image without an explicit size
_MIN_SIDE: Final = 2.0  # inches; smallest view of an image without an explicit size
_MARGINS: Final = (0.62, 0.48, 0.24, 0.2)  # inches; left, bottom, right and top margins of the axes
_LABEL_LENGTH: Final = 4  # characters of a y tick label that fit in the left margin
_CHARACTER_WIDTH: Final = 0.09  # inches
_PADDING: Final = 0.02  # fraction of the longer side of the scene
_MIN_PADDING: Final = 0.25  # m; space around a small scene, such as a robot without a map
_MAX_COORDINATE: Final = 1e9  # m
_MIN_VIEW: Final = 1e-3  # m
_EMPTY_VIEW: Final = (-5.0, -5.0, 5.0, 5.0)  # m


@dataclass(frozen=True, slots=True)
class Layout:
    """Placement of a view of the world in an image.

    Attributes:
        size: Width and height of the image [pixels].
        frame: Left, bottom, width and height of the part that shows the world, measured from the
            lower left corner of the image [pixels].
        view: Bounds of the world shown in the frame, with the aspect ratio of the frame [m].
        has_axes: Whether axes are drawn around the frame.
    """

    size: tuple[int, int]
    frame: tuple[int, int, int, int]
    view: Bounds
    has_axes: bool

    @classmethod
    def make(cls, size: tuple[int, int] | None, dpi: float, view: Bounds, axes: bool) -> Layout:
        """Computes a layout; see `draw` for the arguments.

        Raises:
            ValueError: The size is out of range, or too small for the axes.
        """
        layout = cls._make(size, dpi, view, axes, 0.0)
        excess = _label_length(layout.view[1], layout.view[3]) - _LABEL_LENGTH
        if axes and excess > 0:
            return cls._make(size, dpi, view, axes, excess * _CHARACTER_WIDTH)
        return layout

    @classmethod
    def _make(
        cls, size: tuple[int, int] | None, dpi: float, view: Bounds, axes: bool, extra_left: float
    ) -> Layout:
        """Computes a layout whose left margin is `extra_left` inches wider than the default."""
        left, bottom, right, top = (round(m * dpi) if axes else 0 for m in _MARGINS)
        left += round(extra_left * dpi)
        x_min, y_min, x_max, y_max = view
        width, height = x_max - x_min, y_max - y_min
        if size is None:
            scale = min(_DEFAULT_AREA[0] / width, _DEFAULT_AREA[1] / height) * dpi
            sides = [round(max(side * scale, _MIN_SIDE * dpi)) for side in (width, height)]
            size = (sides[0] + left + right, sides[1] + bottom + top)
        columns, rows = _checked_size(size)
        frame = (left, bottom, columns - left - right, rows - bottom - top)
        if min(frame[2:]) < 1:
            raise ValueError(f"size {columns} x {rows} is too small for the axes at {dpi:g} dpi")
        scale = min(frame[2] / width, frame[3] / height)
        x, y = (x_min + x_max) / 2, (y_min + y_max) / 2
        dx, dy = frame[2] / scale / 2, frame[3] / scale / 2
        return cls((columns, rows), frame, (x - dx, y - dy, x + dx, y + dy), axes)

    @property
    def scale(self) -> float:
        """Pixels per metre."""
        return self.frame[2] / (self.view[2] - self.view[0])


def default_view(scene: Scene) -> Bounds:
    """Returns a view that contains the whole scene, with some padding."""
    bounds = scene_bounds(scene)
    if bounds is None:
        return _EMPTY_VIEW
    x_min, y_min, x_max, y_max = bounds
    padding = max(_PADDING * max(x_max - x_min, y_max - y_min), _MIN_PADDING)
    return (x_min - padding, y_min - padding, x_max + padding, y_max + padding)


def checked_view(view: Sequence[float]) -> Bounds:
    """Converts a view to bounds.

    Raises:
        ValueError: The view does not consist of four numbers, or they are out of range.
    """
    numbers = plain_numbers(view, (4,))
    if numbers is None:
        raise ValueError(
            f"view must be four numbers (x_min, y_min, x_max, y_max), got {shown(view)}"
        )
    x_min, y_min, x_max, y_max = numbers
    in_range = all(abs(number) <= _MAX_COORDINATE for number in numbers)  # False for NaN
    if not (in_range and x_max - x_min >= _MIN_VIEW and y_max - y_min >= _MIN_VIEW):
        raise ValueError(
            f"view must be within +-{_MAX_COORDINATE:g} m, with x_min < x_max and y_min < y_max, "
            f"at least {_MIN_VIEW:g} m apart, got {numbers}"
        )
    return (x_min, y_min, x_max, y_max)


def _label_length(low: float, high: float) -> int:
    """Returns the length of the longest tick label of an axis from `low` to `high` [m]."""
    # matplotlib draws at most 10 ticks, at steps of 1, 2, 2.5 or 5 times a power of ten.
    decimals = min(max(0, 1 - math.floor(math.log10((high - low) / 10))), 4)
    return max(len(f"{number:.{decimals}f}") for number in (low, high))


def _checked_size(size: tuple[int, int]) -> tuple[int, int]:
    sides = plain_numbers(size, (2,))
    if sides is None:
        raise ValueError(f"size must be (width, height) in pixels, got {shown(size)}")
    if not all(side.is_integer() and 1 <= side <= _MAX_SIDE for side in sides):
        raise ValueError(
            f"size must be whole numbers of pixels from 1 to {_MAX_SIDE}, got {shown(size)}"
        )
    return (int(sides[0]), int(sides[1]))
