"""Public functions that draw a world: as an array, as a matplotlib figure, or to a file.

matplotlib is imported when the first image is drawn. Its global state (pyplot) is not used.
"""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from flatland.checks import checked_names, checked_path, checked_range
from flatland.drawing.layout import Layout, checked_view, default_view
from flatland.errors import FlatlandError
from flatland.extras import missing
from flatland.output_files import write_bytes
from flatland.scene.world_scene import Scene, describe_world

if TYPE_CHECKING:
    from flatland.world import World

PICTURE_FORMATS: Final = (".png", ".pdf", ".svg")
NOTEBOOK_DPI: Final = 72.0  # an image of at most 936 x 648 pixels

# matplotlib shares its font cache between figures, and the cache is not thread-safe.
MATPLOTLIB_LOCK = threading.Lock()


class DrawOptions(TypedDict, total=False):
    """The options of a picture, as keyword arguments; `Picture` has the defaults.

    Attributes:
        size: (width, height) of the image [pixels]; None fits the view into 13 x 9 inches.
        dpi: Pixels per inch; scales lines and text.
        view: (x_min, y_min, x_max, y_max) of the area to show, world frame [m]; None shows all
            walls and models. The area is extended to the aspect ratio of the image, so that the
            scale is the same along x and y.
        layers: Names of the layers to draw, None for all. Models are always drawn.
        scans: Whether to draw laser scans.
        names: Whether to write the name of each model above it.
        axes: Whether to draw axes in metres; without axes, the view fills the whole image.
    """

    size: tuple[int, int] | None
    dpi: float
    view: Sequence[float] | None
    layers: Iterable[str] | None
    scans: bool
    names: bool
    axes: bool


@dataclass(slots=True)
class Picture:
    """What to draw; see `DrawOptions`."""

    size: tuple[int, int] | None = None
    dpi: float = 100.0
    view: Sequence[float] | None = None
    layers: Iterable[str] | None = None
    scans: bool = True
    names: bool = False
    axes: bool = True

    def __post_init__(self) -> None:
        if isinstance(self.layers, str):
            raise ValueError(f"layers must be a list of names, got {self.layers!r}")
        if self.layers is not None:
            self.layers = checked_names("layers", self.layers)


def draw(
    world: World,
    **options: Unpack[DrawOptions],
) -> npt.NDArray[np.uint8]:
    """Draws the current state of a world.

    Walls are drawn in the colour of their layer and footprints in the colour of their body; bright
    colours are darkened to be visible on white. Sensors are dashed, and a triangle shows the
    heading of each model. Each laser is shown with its last scan, or, if it has not scanned yet,
    with an exact scan from its current pose.

    Does not modify the world. The same world and options give the same image. May be called from
    any thread and from the hooks of a plugin.

    Args:
        world: The world to draw.
        **options: The members of `DrawOptions`.

    Returns:
        RGB image, top row first, shape (height, width, 3).

    Raises:
        FlatlandError: The world is closed, a layer does not exist, or matplotlib is missing.
        ValueError: `size`, `dpi`, `view` or `layers` is invalid.
    """
    figure = make_figure(world, **options)
    with MATPLOTLIB_LOCK:
        figure.canvas.draw()
        pixels = np.asarray(figure.canvas.buffer_rgba())
    return np.ascontiguousarray(pixels[:, :, :3])


def make_figure(
    world: World,
    **options: Unpack[DrawOptions],
) -> Any:
    """Draws a world into a matplotlib figure that can be extended and saved.

    The units of `figure.axes[0]` are metres in the world frame.

    Args:
        world: The world to draw.
        **options: See `draw`.

    Returns:
        A `matplotlib.figure.Figure` on an Agg canvas, not registered with pyplot.

    Raises:
        FlatlandError: The world is closed, a layer does not exist, or matplotlib is missing.
        ValueError: `size`, `dpi`, `view` or `layers` is invalid.
    """
    picture = Picture(**options)
    scene, layout = lay_out(world, picture)
    from flatland.drawing.painter import paint

    with MATPLOTLIB_LOCK:
        return paint(scene, layout, picture.dpi, picture.names)


def save(
    world: World,
    path: str | os.PathLike[str],
    **options: Unpack[DrawOptions],
) -> None:
    """Draws a world to a file, overwriting an existing one.

    Args:
        world: The world to draw.
        path: File name with one of the extensions in `PICTURE_FORMATS`; PDF and SVG are vector
            graphics.
        **options: See `draw`.

    Raises:
        FlatlandError: The world is closed, a layer does not exist, or matplotlib is missing.
        OSError: The file cannot be written.
        ValueError: The extension is unknown, or `size`, `dpi`, `view` or `layers` is invalid.
    """
    suffix = Path(checked_path("path", path)).suffix.lower()
    if suffix not in PICTURE_FORMATS:
        raise ValueError(f"path must end with one of {', '.join(PICTURE_FORMATS)}, got {path!r}")
    figure = make_figure(world, **options)
    file = io.BytesIO()  # matplotlib does not always raise the error of a full disk.
    with MATPLOTLIB_LOCK:
        if suffix == ".png":
            figure.canvas.print_png(file)
        else:
            figure.savefig(file, format=suffix[1:])
    write_bytes(path, file.getvalue())


def lay_out(world: World, picture: Picture) -> tuple[Scene, Layout]:
    """Returns the contents and the layout of an image of the current state.

    Args:
        world: The world to draw.
        picture: What to draw.

    Raises:
        FlatlandError: The world is closed, a layer does not exist, or matplotlib is missing.
        ValueError: `size`, `dpi`, `view` or `layers` is invalid.
    """
    check_matplotlib()
    dpi, view = checked_range("dpi", picture.dpi, 10, 2400), picture.view
    bounds = None if view is None else checked_view(view)
    scene = world.between_steps(lambda: describe_world(world, picture.layers, picture.scans))
    return scene, Layout.make(picture.size, dpi, bounds or default_view(scene), picture.axes)


def draw_png(world: World) -> bytes | None:
    """Draws a world for a notebook.

    Args:
        world: The world to draw.

    Returns:
        A PNG image; None if the world is closed, or matplotlib is missing.
    """
    try:
        figure = make_figure(world, dpi=NOTEBOOK_DPI)
    except FlatlandError:
        return None
    file = io.BytesIO()
    with MATPLOTLIB_LOCK:
        figure.canvas.print_png(file)
    return file.getvalue()


def check_matplotlib() -> None:
    """Checks that matplotlib can be imported.

    Raises:
        FlatlandError: matplotlib is missing or broken.
    """
    try:
        import flatland.drawing.painter  # noqa: F401
    except Exception as error:  # see `require`
        raise missing("matplotlib", "drawing needs", error) from error
