"""Render modes, and images of an environment."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from flatland.drawing.render import MATPLOTLIB_LOCK, make_figure
from flatland.geometry import Vector2

if TYPE_CHECKING:
    from flatland.world import World

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
