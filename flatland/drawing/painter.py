"""Paints a scene with matplotlib; the only module that imports it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from flatland.body import Color
from flatland.drawing.capture import Scene, Sweep
from flatland.geometry import Pose, compose
from flatland.values import DoubleArray

if TYPE_CHECKING:
    from flatland.drawing.layout import Layout

_PAPER, _FLOOR, _GRID, _FRAME, _INK = "#ffffff", "#fbfbf9", "#ebebe6", "#c8c8c0", "#4a4a46"
_BEAMS: Final = ("#e0392b", "#0f8b8d", "#8e44ad", "#d68910", "#2471a3", "#c2185b", "#558b2f")
_FILLING: Final = 0.6  # opacity of a footprint, times its colour's own
_HEADING: Final = 0.4  # length of the triangle that points ahead, of the body's breadth
_BRIGHTEST: Final = 0.5  # luminance that still shows on the floor
_WALL: Final = 1.44  # points: 2 pixels at 100 dpi, so that straight walls are crisp
_SMALLEST: Final = 0.08  # inches; a model smaller than that is shown by a triangle of that size

# From below to above; the grid is below them all.
_SWEEPS, _WALLS, _HITS, _MODELS, _JOINTS, _HEADINGS, _NAMES = range(1, 8)


def paint(scene: Scene, layout: Layout, dpi: float, names: bool) -> Figure:
    """Paints a scene.

    Args:
        scene: What to paint.
        layout: Where it goes.
        dpi: Pixels an inch, which lines and letters scale with.
        names: Whether to write the models' names beside them.
    """
    columns, rows = layout.size
    # matplotlib cuts off what is behind the point, and 29 / 100 * 100 is less than 29.
    inches = ((columns + 1e-3) / dpi, (rows + 1e-3) / dpi)
    figure = Figure(figsize=inches, dpi=dpi, facecolor=_PAPER)
    FigureCanvasAgg(figure)
    left, below, width, height = layout.frame
    axes = figure.add_axes(
        (left / columns, below / rows, width / columns, height / rows), facecolor=_FLOOR
    )
    x_min, y_min, x_max, y_max = layout.view
    axes.set(xlim=(x_min, x_max), ylim=(y_min, y_max), autoscale_on=False)
    _paint_axes(axes, layout.has_axes)
    for i, sweep in enumerate(scene.sweeps):
        _paint_sweep(axes, sweep, _BEAMS[i % len(_BEAMS)])
    for walls in scene.walls:
        lines = LineCollection(
            walls.edges, colors=[_shown(walls.color)], linewidths=_WALL, capstyle="projecting"
        )
        _add(axes, lines, _WALLS)
    _paint_footprints(axes, scene)
    _paint_joints(axes, scene)
    _paint_headings(axes, scene, smallest=_SMALLEST * dpi / layout.scale)
    if names:
        _paint_names(axes, scene)
    return figure


def _add(axes: Any, collection: Collection, level: int) -> None:
    collection.set_zorder(level)
    axes.add_collection(collection, autolim=False)


# -- colours -------------------------------------------------------------------------------


def _shown(color: Color) -> Color:
    """Darkens a colour that would not show on the floor; white is what files have by default."""
    r, g, b, a = (min(max(part, 0.0), 1.0) for part in color)
    luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b
    factor = _BRIGHTEST / max(luminance, _BRIGHTEST)
    return (r * factor, g * factor, b * factor, a)


def _filling(color: Color) -> Color:
    r, g, b, a = _shown(color)
    return (r, g, b, a * _FILLING)


def _stroke(color: Color) -> Color:
    """Returns the colour of an outline; what is meant to be invisible has none."""
    r, g, b, a = _shown(color)
    return (0.55 * r, 0.55 * g, 0.55 * b, 1.0 if a else 0.0)


# -- parts ---------------------------------------------------------------------------------


def _paint_axes(axes: Any, visible: bool) -> None:
    axes.grid(visible=True, color=_GRID, linewidth=0.7, linestyle="-")
    axes.set_axisbelow(True)
    axes.tick_params(color=_FRAME, labelcolor=_INK, labelsize=9, length=3, width=0.7)
    for spine in axes.spines.values():
        spine.set(visible=visible, edgecolor=_FRAME, linewidth=0.8)
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        axis.set_label_text(f"{name} [m]", fontsize=10, color=_INK)
        axis.set_visible(visible)  # ticks, labels and grid


def _paint_sweep(axes: Any, sweep: Sweep, color: str) -> None:
    area = PolyCollection([sweep.area], facecolors=color, alpha=0.07, linewidths=0)
    _add(axes, area, _SWEEPS)
    axes.plot(
        *sweep.hits.T,
        linestyle="none",
        marker="o",
        markersize=2.4,
        markeredgewidth=0,
        color=color,
        zorder=_HITS,
    )


def _paint_footprints(axes: Any, scene: Scene) -> None:
    outlines = [outline for model in scene.figurines for outline in model.outlines]
    for is_sensor in (False, True):
        some = [outline for outline in outlines if outline.is_sensor == is_sensor]
        footprints = PolyCollection(
            [outline.points for outline in some],
            facecolors=["none" if is_sensor else _filling(outline.color) for outline in some],
            edgecolors=[_stroke(outline.color) for outline in some],
            linewidths=0.9,
            linestyles="dashed" if is_sensor else "solid",
        )
        _add(axes, footprints, _MODELS)


def _paint_joints(axes: Any, scene: Scene) -> None:
    if not scene.links:
        return
    colors = [_shown(link.color) for link in scene.links]
    points = [link.points for link in scene.links]
    _add(axes, LineCollection(points, colors=colors, linewidths=1.0), _JOINTS)
    anchors = np.concatenate([link[1:3] for link in points])
    axes.scatter(
        *anchors.T, s=6, c=np.repeat(np.array(colors), 2, axis=0), linewidths=0, zorder=_JOINTS
    )


def _paint_headings(axes: Any, scene: Scene, smallest: float) -> None:
    arrows, colors = [], []
    for model in scene.figurines:
        box = model.box()
        if model.middle is None or box is None:
            continue
        is_tiny = max(box[2] - box[0], box[3] - box[1]) < smallest
        length = smallest if is_tiny else _HEADING * model.breadth
        arrows.append(_arrow(model.middle, length))
        colors.append(_stroke(model.color))
    _add(axes, PolyCollection(arrows, facecolors=colors, linewidths=0), _HEADINGS)


def _arrow(middle: Pose, length: float) -> DoubleArray:
    """Returns the corners of a triangle that points ahead, shape (3, 2)."""
    # Longer than wide: which corner is the foremost one is to be seen at any heading.
    corners = [(0.6, 0.0), (-0.4, 0.3), (-0.4, -0.3)]
    return np.array([compose(middle, (length * x, length * y, 0.0))[:2] for x, y in corners])


def _paint_names(axes: Any, scene: Scene) -> None:
    for model in scene.figurines:
        box = model.box()
        if box is None:
            continue
        axes.annotate(
            model.name,
            ((box[0] + box[2]) / 2, box[3]),
            xytext=(0, 4),
            textcoords="offset points",
            horizontalalignment="center",
            verticalalignment="bottom",
            parse_math=False,
            fontsize=8.5,
            color=_INK,
            path_effects=[withStroke(linewidth=2.5, foreground=_FLOOR)],
            annotation_clip=True,
            clip_on=True,
            zorder=_NAMES,
        )
