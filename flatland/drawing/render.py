"""Pictures of a world without ROS: map, models, joints and what the lasers see, by matplotlib.

matplotlib is needed only here, and only once something is drawn. Nothing of its global state is
used (no pyplot), and drawing changes nothing in the world.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from flatland.drawing.capture import look_at
from flatland.drawing.layout import Layout, checked_view, whole_view
from flatland.errors import FlatlandError

if TYPE_CHECKING:
    from flatland.world import World

PICTURE_FORMATS: Final = (".png", ".pdf", ".svg")

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
    from flatland.drawing.painter import paint

    if not (math.isfinite(dpi) and 10 <= dpi <= 2400):
        raise ValueError(f"dpi must be from 10 to 2400, got {dpi}")
    if isinstance(layers, str):
        raise ValueError(f"layers must be a list of names, got {layers!r}")
    wanted = None if view is None else checked_view(view)
    scene = world.between_steps(lambda: look_at(world, layers, scans))
    layout = Layout.make(size, dpi, wanted or whole_view(scene), axes)
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
        import flatland.drawing.painter  # noqa: F401
    except ImportError as error:
        raise FlatlandError(
            f"drawing needs matplotlib ({error}): "
            "apt-get install python3-matplotlib, or pip install matplotlib"
        ) from error
