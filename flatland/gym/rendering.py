"""Images of an environment, and a window that shows them."""

from __future__ import annotations

import importlib
import logging
import os
import time
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from flatland.drawing.render import MATPLOTLIB_LOCK, make_figure
from flatland.geometry import Vector2

if TYPE_CHECKING:
    from flatland.world import World

_LOG = logging.getLogger("flatland")

Image = npt.NDArray[np.uint8]

_SIZE: Final = (800, 600)  # pixels
_DPI: Final = 80.0


def checked_render_mode(mode: str | None, metadata: Mapping[str, Any]) -> str | None:
    """Returns a render mode.

    Raises:
        ValueError: It is unknown.
    """
    modes = metadata["render_modes"]
    if mode is not None and mode not in modes:
        raise ValueError(f"render_mode must be None or one of {', '.join(modes)}, got {mode!r}")
    return mode


def draw_goals(world: World, goals: Iterable[Vector2], radius: float) -> Image:
    """Draws a world with goals.

    Args:
        world: The world.
        goals: Goals in the world frame [m].
        radius: Distance at which an agent has arrived [m].

    Returns:
        RGB image, top row first, shape (height, width, 3).

    Raises:
        FlatlandError: matplotlib is missing.
    """
    figure = make_figure(world, size=_SIZE, dpi=_DPI)
    patches = importlib.import_module("matplotlib.patches")
    with MATPLOTLIB_LOCK:
        for goal in goals:
            figure.axes[0].add_patch(patches.Circle(goal, radius, color="tab:green", alpha=0.6))
        figure.canvas.draw()
        pixels = np.asarray(figure.canvas.buffer_rgba())
    return np.ascontiguousarray(pixels[:, :, :3])


class Renderer:
    """Renders an environment in its mode."""

    def __init__(self, mode: str | None, dt: float) -> None:
        """Creates the renderer; a window opens with the first image.

        Args:
            mode: `rgb_array`, `human` or None.
            dt: Simulated time of a step of the environment [s]; a window shows it in real time.
        """
        self._mode = mode
        self._dt = dt
        self._window: Window | None = None
        self._has_display = True

    def render(self, world: World, goals: Iterable[Vector2], radius: float) -> Image | None:
        """Returns an image for `rgb_array`; shows it for `human`; otherwise has no effect."""
        if self._mode == "rgb_array":
            return draw_goals(world, goals, radius)
        if self._mode == "human" and self._has_display:
            if self._window is None:
                self._window = open_window()
                self._has_display = self._window is not None
            if self._window is not None:
                self._window.show(draw_goals(world, goals, radius), self._dt)
        return None

    def close(self) -> None:
        """Closes the window; further calls have no effect."""
        if self._window is not None:
            self._window.close()
            self._window = None


class Window:
    """A window of matplotlib that shows images."""

    def __init__(self, pyplot: Any) -> None:
        """Opens the window.

        Args:
            pyplot: The module `matplotlib.pyplot`.
        """
        self._pyplot = pyplot
        self._figure = pyplot.figure("flatland", figsize=(_SIZE[0] / _DPI, _SIZE[1] / _DPI))
        self._axes = self._figure.add_axes((0, 0, 1, 1))
        self._axes.set_axis_off()
        self._picture: Any = None
        self._due = time.monotonic()

    def show(self, image: Image, dt: float) -> None:
        """Shows an image, at the earliest `dt` [s] after the previous one."""
        if self._picture is None:
            self._picture = self._axes.imshow(image)
        else:
            self._picture.set_data(image)
        self._figure.canvas.draw_idle()
        self._due = max(self._due + dt, time.monotonic())
        self._figure.canvas.start_event_loop(max(self._due - time.monotonic(), 0.001))

    def close(self) -> None:
        """Closes the window."""
        self._pyplot.close(self._figure)


def open_window() -> Window | None:
    """Returns a new window; None, with a message in the log, if there is no display."""
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        _LOG.warning('render_mode "human": no display, nothing is shown; see also "rgb_array"')
        return None
    matplotlib = importlib.import_module("matplotlib")
    pyplot = importlib.import_module("matplotlib.pyplot")
    backends = importlib.import_module("matplotlib.rcsetup").interactive_bk
    interactive = {name.lower() for name in backends}
    if matplotlib.get_backend().lower() not in interactive:
        _LOG.warning(
            'render_mode "human": matplotlib has no window (backend %s), nothing is shown; '
            "install python3-tk or python3-pyqt5",
            matplotlib.get_backend(),
        )
        return None
    return Window(pyplot)
