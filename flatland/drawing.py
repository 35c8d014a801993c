"""Pictures of a world without ROS: map, models, joints and what the lasers see, by matplotlib.

matplotlib is needed only here, and only once something is drawn. Nothing of its global state is
used (no pyplot), and drawing changes nothing in the world.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from flatland.errors import FlatlandError
from flatland.scene import Box, Scene, look_at

if TYPE_CHECKING:
    from flatland.world import World

PICTURE_FORMATS: Final = (".png", ".pdf", ".svg")

_LONGEST_SIDE: Final = 20_000  # pixels; matplotlib ends at 65 536
_ROOM: Final = (13.0, 9.0)  # inches that a picture without a size may take
_NARROWEST: Final = 2.0  # inches that it takes at least
_MARGINS: Final = (0.62, 0.48, 0.24, 0.2)  # inches left, below, right and above, with axes
_CHARACTERS: Final = 4  # of a number at the y axis, that the left margin has room for
_CHARACTER: Final = 0.09  # inches for each one more
_PADDING: Final = 0.02  # of the longer side of what is there
_FARTHEST, _NEAREST = 1e9, 1e-3  # m; coordinates, and sides of a view
_EMPTY_VIEW: Final = (-5.0, -5.0, 5.0, 5.0)  # m

# matplotlib shares its fonts between figures, and they are not made for threads.
_DRAWING = threading.Lock()


def draw(
    world: World,
    *,
    size: tuple[int, int] | None = None,
    dpi: float = 100.0,
    view: Sequence[float] | None = None,
    layers: Iterable[str] | None = None,
    scans: bool = True,
    names: bool = False,
    axes: bool = True,
) -> npt.NDArray[np.uint8]:
    """Draws a world as it is now.

    Walls have the colour of their layer and footprints that of their body (darkened where it would
    not show on white), sensors are dashed, a triangle says where a model heads. Each laser shows
    its latest scan, or, where none of now was emitted, what it sees without noise. The same world
    and options give the same picture. May be called from any thread and from a plugin's hooks.

    Args:
        world: The world; it stays exactly as it is.
        size: (width, height) of the picture [pixels]; None for as much as the view takes of
            13 x 9 inches.
        dpi: Pixels an inch, which lines and letters scale with.
        view: (x_min, y_min, x_max, y_max) to be seen at least, world frame [m]; None for all
            walls and models. It grows to the shape of the picture: a metre is as long along x
            as along y.
        layers: Names of the layers to draw, None for all. Models are drawn in any case.
        scans: Whether to draw what the lasers see.
        names: Whether to write the models' names beside them.
        axes: Whether to draw axes in metres; without, the view fills the picture to its rim.

    Returns:
        Red, green and blue of each pixel, the top row first, shape (height, width, 3).

    Raises:
        FlatlandError: The world is closed, a layer is unknown, or matplotlib is missing.
        ValueError: `size`, `dpi`, `view` or `layers` is not as it must be.
    """
    figure = make_figure(
        world,
        size=size,
        dpi=dpi,
        view=view,
        layers=layers,
        scans=scans,
        names=names,
        axes=axes,
    )
    with _DRAWING:
        figure.canvas.draw()
        pixels = np.asarray(figure.canvas.buffer_rgba())
    return np.ascontiguousarray(pixels[:, :, :3])


def make_figure(
    world: World,
    *,
    size: tuple[int, int] | None = None,
    dpi: float = 100.0,
    view: Sequence[float] | None = None,
    layers: Iterable[str] | None = None,
    scans: bool = True,
    names: bool = False,
    axes: bool = True,
) -> Any:
    """Draws a world into a matplotlib figure, to draw more into or to save as PDF or SVG.

    `figure.axes[0]` is in metres of the world frame, `figure.savefig(path)` writes a file.

    Args:
        world: The world; it stays exactly as it is.
        size: As for `draw`.
        dpi: As for `draw`.
        view: As for `draw`.
        layers: As for `draw`.
        scans: As for `draw`.
        names: As for `draw`.
        axes: As for `draw`.

    Returns:
        A `matplotlib.figure.Figure` on an Agg canvas, unknown to pyplot.

    Raises:
        FlatlandError: The world is closed, a layer is unknown, or matplotlib is missing.
        ValueError: `size`, `dpi`, `view` or `layers` is not as it must be.
    """
    check_matplotlib()
    from flatland.scene_painter import paint

    if not (math.isfinite(dpi) and 10 <= dpi <= 2400):
        raise ValueError(f"dpi must be from 10 to 2400, got {dpi}")
    if isinstance(layers, str):
        raise ValueError(f"layers must be a list of names, got {layers!r}")
    wanted = None if view is None else _checked_view(view)
    scene = world.between_steps(lambda: look_at(world, layers, scans))
    layout = Layout.make(size, dpi, wanted or _whole(scene), axes)
    with _DRAWING:
        return paint(scene, layout, dpi, names)


def save(world: World, path: str | os.PathLike[str], **options: Any) -> None:
    """Draws a world into a file; one that is there is overwritten.

    Args:
        world: The world; it stays exactly as it is.
        path: Ends with one of `PICTURE_FORMATS`; in PDF and SVG lines stay lines.
        **options: As for `draw`.

    Raises:
        FlatlandError: The world is closed, a layer is unknown, or matplotlib is missing.
        OSError: The file cannot be written.
        ValueError: The path ends otherwise, or an option is out of its range.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in PICTURE_FORMATS:
        raise ValueError(f"path must end with one of {', '.join(PICTURE_FORMATS)}, got {path!r}")
    figure = make_figure(world, **options)
    with _DRAWING:
        if suffix == ".png":
            figure.canvas.print_png(path)
        else:
            figure.savefig(path, format=suffix[1:])


def check_matplotlib() -> None:
    """Finds out whether pictures can be drawn.

    Raises:
        FlatlandError: matplotlib is missing or does not work.
    """
    try:
        import flatland.scene_painter  # noqa: F401
    except ImportError as error:
        raise FlatlandError(
            f"drawing needs matplotlib ({error}): "
            "apt-get install python3-matplotlib, or pip install matplotlib"
        ) from error


# -- where things go -----------------------------------------------------------------------


def _checked_view(view: Sequence[float]) -> Box:
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


def _whole(scene: Scene) -> Box:
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
