"""Draws a scene with matplotlib; the only module that imports matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from flatland.drawing.capture import ScanDrawing, Scene
from flatland.entities.body import Color
from flatland.geometry import DoubleArray, Pose, transform_points

if TYPE_CHECKING:
    from flatland.drawing.layout import Layout

_PAPER, _FLOOR, _GRID, _FRAME, _INK = "#ffffff", "#fbfbf9", "#ebebe6", "#c8c8c0", "#4a4a46"
_SCAN_COLORS: Final = ("#e0392b", "#0f8b8d", "#8e44ad", "#d68910", "#2471a3", "#c2185b", "#558b2f")
_FILL_OPACITY: Final = 0.6  # of a footprint, multiplied by the opacity of its colour
_HEADING_LENGTH: Final = 0.4  # of the heading triangle, as a fraction of the model's width
_MAX_LUMINANCE: Final = 0.5  # of a colour that is visible on the floor
_WALL_WIDTH: Final = 1.44  # points: 2 pixels at 100 dpi, so that straight walls are crisp
_MIN_MODEL_SIZE: Final = 0.08  # inches; a smaller model is drawn as a triangle of this size

# z-orders, from bottom to top; the grid is below all of them.
_SCANS, _WALLS, _HITS, _MODELS, _JOINTS, _HEADINGS, _NAMES = range(1, 8)


def paint(scene: Scene, layout: Layout, dpi: float, names: bool) -> Figure:
    """Draws a scene into a new figure.

    Args:
        scene: Contents of the image.
        layout: Placement of the scene in the image.
        dpi: Pixels per inch; scales lines and text.
        names: Whether to write the name of each model above it.
    """
    columns, rows = layout.size
    # matplotlib truncates the size in pixels, and 29 / 100 * 100 is less than 29.
    inches = ((columns + 1e-3) / dpi, (rows + 1e-3) / dpi)
    figure = Figure(figsize=inches, dpi=dpi, facecolor=_PAPER)
    FigureCanvasAgg(figure)
    axes = _add_axes(figure, layout)
    _paint_walls(axes, scene)
    paint_models(axes, scene, layout, dpi, names)
    return figure


def _add_axes(figure: Figure, layout: Layout) -> Any:
    columns, rows = layout.size
    left, bottom, width, height = layout.frame
    axes = figure.add_axes(
        (left / columns, bottom / rows, width / columns, height / rows), facecolor=_FLOOR
    )
    x_min, y_min, x_max, y_max = layout.view
    axes.set(xlim=(x_min, x_max), ylim=(y_min, y_max), autoscale_on=False)
    _paint_axes(axes, layout.has_axes)
    return axes


def paint_models(axes: Any, scene: Scene, layout: Layout, dpi: float, names: bool) -> None:
    """Draws everything that moves: scans, models and joints.

    Args:
        axes: Axes of a figure of `paint`.
        scene: Contents of the image; its layers are not drawn.
        layout: See `paint`.
        dpi: See `paint`.
        names: See `paint`.
    """
    for i, scan in enumerate(scene.scans):
        _paint_scan(axes, scan, _SCAN_COLORS[i % len(_SCAN_COLORS)])
    _paint_footprints(axes, scene)
    _paint_joints(axes, scene)
    _paint_headings(axes, scene, min_size=_MIN_MODEL_SIZE * dpi / layout.scale)
    if names:
        _paint_names(axes, scene)


def _paint_walls(axes: Any, scene: Scene) -> None:
    for layer in scene.layers:
        lines = LineCollection(
            layer.edges,
            colors=[_visible(layer.color)],
            linewidths=_WALL_WIDTH,
            capstyle="projecting",
        )
        _add(axes, lines, _WALLS)


def _add(axes: Any, collection: Collection, zorder: int) -> None:
    collection.set_zorder(zorder)
    axes.add_collection(collection, autolim=False)


# -- colours -------------------------------------------------------------------------------


def _visible(color: Color) -> Color:
    """Darkens a colour that is too bright for the floor, such as white, the default of files."""
    r, g, b, a = (min(max(part, 0.0), 1.0) for part in color)
    luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b
    factor = _MAX_LUMINANCE / max(luminance, _MAX_LUMINANCE)
    return (r * factor, g * factor, b * factor, a)


def _fill(color: Color) -> Color:
    r, g, b, a = _visible(color)
    return (r, g, b, a * _FILL_OPACITY)


def _stroke(color: Color) -> Color:
    """Returns the colour of an outline, transparent for a fully transparent colour."""
    r, g, b, a = _visible(color)
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


def _paint_scan(axes: Any, scan: ScanDrawing, color: str) -> None:
    area = PolyCollection([scan.area], facecolors=color, alpha=0.07, linewidths=0)
    _add(axes, area, _SCANS)
    axes.plot(
        *scan.hits.T,
        linestyle="none",
        marker="o",
        markersize=2.4,
        markeredgewidth=0,
        color=color,
        zorder=_HITS,
    )


def _paint_footprints(axes: Any, scene: Scene) -> None:
    outlines = [outline for model in scene.models for outline in model.outlines]
    for is_sensor in (False, True):
        selected = [outline for outline in outlines if outline.is_sensor == is_sensor]
        footprints = PolyCollection(
            [outline.points for outline in selected],
            facecolors=["none" if is_sensor else _fill(outline.color) for outline in selected],
            edgecolors=[_stroke(outline.color) for outline in selected],
            linewidths=0.9,
            linestyles="dashed" if is_sensor else "solid",
        )
        _add(axes, footprints, _MODELS)


def _paint_joints(axes: Any, scene: Scene) -> None:
    if not scene.joints:
        return
    colors = [_visible(joint.color) for joint in scene.joints]
    points = [joint.points for joint in scene.joints]
    _add(axes, LineCollection(points, colors=colors, linewidths=1.0), _JOINTS)
    anchors = np.concatenate([joint[1:3] for joint in points])
    axes.scatter(
        *anchors.T, s=6, c=np.repeat(np.array(colors), 2, axis=0), linewidths=0, zorder=_JOINTS
    )


def _paint_headings(axes: Any, scene: Scene, min_size: float) -> None:
    arrows, colors = [], []
    for model in scene.models:
        bounds = model.bounds()
        if model.center is None or bounds is None:
            continue
        is_tiny = max(bounds[2] - bounds[0], bounds[3] - bounds[1]) < min_size
        length = min_size if is_tiny else _HEADING_LENGTH * model.width
        arrows.append(_arrow(model.center, length))
        colors.append(_stroke(model.color))
    _add(axes, PolyCollection(arrows, facecolors=colors, linewidths=0), _HEADINGS)


def _arrow(pose: Pose, length: float) -> DoubleArray:
    """Returns the vertices of a triangle that points along the x axis of a pose, shape (3, 2)."""
    # Longer than wide, so that the tip can be told from the other vertices.
    return transform_points(pose, length * np.array([(0.6, 0.0), (-0.4, 0.3), (-0.4, -0.3)]))


def _paint_names(axes: Any, scene: Scene) -> None:
    for model in scene.models:
        bounds = model.bounds()
        if bounds is None:
            continue
        axes.annotate(
            model.name,
            ((bounds[0] + bounds[2]) / 2, bounds[3]),
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
