"""Pictures of one world at many times, for videos."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt

from flatland.drawing.layout import Layout
from flatland.drawing.render import MATPLOTLIB_LOCK, DrawOptions, Picture, lay_out
from flatland.runtime.observer import WorldObserver
from flatland.scene.world_scene import Scene, describe_world

if TYPE_CHECKING:
    from flatland.world import World


class FrameRenderer(WorldObserver):
    """Draws pictures of a world with the same view.

    Axes and walls are drawn once, so that a picture takes less time than with `draw`; walls that
    change are drawn again. The view is that of the first picture.
    """

    def __init__(self, world: World, **options: Unpack[DrawOptions]) -> None:
        """Determines the view; see `draw` for the arguments.

        The width and height of pictures are rounded down to even numbers, as video codecs require.

        Raises:
            FlatlandError: The world is closed, a layer does not exist, or matplotlib is missing.
            ValueError: `size`, `dpi`, `view` or `layers` is invalid.
        """
        self._world = world
        picture = self._picture = Picture(**options)
        _, layout = lay_out(world, picture)
        columns, rows = (side // 2 * 2 for side in layout.size)
        self._layout = Layout.make(
            (max(columns, 2), max(rows, 2)), picture.dpi, layout.view, picture.axes
        )
        self._figure: Any = None
        self._background: Any = None
        world.add_observer(self)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures [pixels]."""
        return self._layout.size

    def layer_changed(self, layer_name: str) -> None:  # noqa: ARG002
        """Draws the walls again for the next picture."""
        self._background = None

    def picture(self) -> npt.NDArray[np.uint8]:
        """Draws the current state of the world.

        Returns:
            RGB image, top row first, shape (height, width, 3).
        """
        from flatland.drawing.painter import paint, paint_models

        with MATPLOTLIB_LOCK:
            if self._background is None:
                walls = describe_world(self._world, self._picture.layers, scans=False).layers
                scene = Scene(walls, [], [])
                self._figure = paint(scene, self._layout, self._picture.dpi, names=False)
                self._figure.canvas.draw()
                self._background = self._figure.canvas.copy_from_bbox(self._figure.bbox)
            canvas, axes = self._figure.canvas, self._figure.axes[0]
            canvas.restore_region(self._background)
            fixed = set(axes.get_children())
            scene = describe_world(self._world, (), self._picture.scans)
            paint_models(axes, scene, self._layout, self._picture.dpi, self._picture.names)
            moving = [artist for artist in axes.get_children() if artist not in fixed]
            for artist in sorted(moving, key=lambda artist: artist.get_zorder()):
                axes.draw_artist(artist)
            pixels = np.array(canvas.buffer_rgba())[:, :, :3]
            for artist in moving:
                artist.remove()
        return np.ascontiguousarray(pixels)
