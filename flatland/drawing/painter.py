"""Draws a scene with matplotlib; the only module that imports matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from flatland.drawing.footprints import Footprints, footprints_of
from flatland.entities.body import Color
from flatland.geometry import DoubleArray, Pose, circle_points, transform_points
from flatland.scene.description import ModelDescription
from flatland.scene.scans import LaserDescription
from flatland.scene.world_scene import Scene

if TYPE_CHECKING:
    from flatland.drawing.layout import Layout

_PAPER, _FLOOR, _GRID, _FRAME, _INK = "#ffffff", "#fbfbf9", "#ebebe6", "#c8c8c0", "#4a4a46"
_SCAN_COLORS: Final = ("#e0392b", "#0f8b8d", "#8e44ad", "#d68910", "#2471a3", "#c2185b", "#558b2f")
_FILL_OPACITY: Final = 0.6  # of a footprint, multiplied by the opacity of its colour
_HEADING_LENGTH: Final = 0.4  # of the heading triangle, as a fraction of the model's width
_MAX_LUMINANCE: Final = 0.5  # of a colour that is visible on the floor
_FAINT: Final = 0.25  # opacity of walls whose colour is fully transparent
_WALL_WIDTH: Final = 1.44  # points: 2 pixels at 100 dpi, so that straight walls are crisp
_MIN_MODEL_SIZE: Final = 0.08  # inches; a smaller model is drawn as a dot of this size
_DOT_POINTS: Final = 16

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
    for i, laser in enumerate(scene.lasers):
        _paint_scan(axes, laser, _SCAN_COLORS[i % len(_SCAN_COLORS)])
    models = [footprints_of(model) for model in scene.models]
    _paint_footprints(axes, models)
    _paint_joints(axes, scene.models)
    _paint_headings(axes, models, min_size=_MIN_MODEL_SIZE * dpi / layout.scale)
    if names:
        _paint_names(axes, models)


def _paint_walls(axes: Any, scene: Scene) -> None:
    # Walls of an alpha of 0 are drawn faintly, below the others, since a picture without them would
    # often be empty.
    for layer in sorted(scene.layers, key=lambda layer: layer.color[3] > 0):
        r, g, b, a = _visible(layer.color)
        lines = LineCollection(
            layer.world_edges().reshape(-1, 2, 2),
            colors=[(r, g, b, a or _FAINT)],
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


def _paint_scan(axes: Any, laser: LaserDescription, color: str) -> None:
    ends = laser.ends()
    corners = np.concatenate([[laser.scan.pose[:2]], ends])
    area = PolyCollection([corners], facecolors=color, alpha=0.07, linewidths=0)
    _add(axes, area, _SCANS)
    axes.plot(
        *ends[laser.hits()].T,
        linestyle="none",
        marker="o",
        markersize=2.4,
        markeredgewidth=0,
        color=color,
        zorder=_HITS,
    )


def _paint_footprints(axes: Any, models: list[Footprints]) -> None:
    outlines = [outline for model in models for outline in model.outlines]
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


def _paint_joints(axes: Any, models: list[ModelDescription]) -> None:
    lines, anchors, colors = [], [], []
    for model in models:
        for joint in model.joints:
            pose_a, pose_b = (model.bodies[index].pose for index in joint.bodies)
            origin_a, anchor_a, origin_b, anchor_b = joint.points(pose_a, pose_b)
            lines.append([origin_a, anchor_a, anchor_b, origin_b])
            anchors += [anchor_a, anchor_b]
            colors.append(_visible(joint.color))
    if not lines:
        return
    _add(axes, LineCollection(lines, colors=colors, linewidths=1.0), _JOINTS)
    axes.scatter(
        *np.transpose(anchors),
        s=6,
        c=np.repeat(np.array(colors), 2, axis=0),
        linewidths=0,
        zorder=_JOINTS,
    )


def _paint_headings(axes: Any, models: list[Footprints], min_size: float) -> None:
    arrows, colors = [], []
    tiny = []
    for model in models:
        bounds = model.bounds
        if model.center is None or bounds is None:
            continue
        if max(bounds[2] - bounds[0], bounds[3] - bounds[1]) < min_size:
            tiny.append(model)
            continue
        arrows.append(_arrow(model.center, _HEADING_LENGTH * model.width))
        colors.append(_stroke(model.color))
    _add(axes, PolyCollection(arrows, facecolors=colors, linewidths=0), _HEADINGS)
    _paint_dots(axes, tiny, min_size / 2)


def _paint_dots(axes: Any, models: list[Footprints], radius: float) -> None:
    """Draws a dot for each model that is too small to be seen, with a line towards its heading.

    A triangle in place of the dot would hide the model and its colour.
    """
    dots, lines, colors = [], [], []
    for model in models:
        if model.center is not None:
            x, y, _ = model.center
            dots.append(circle_points((x, y), radius, _DOT_POINTS))
            lines.append(transform_points(model.center, radius * np.array([(1, 0), (2, 0)])))
            colors.append(model.color)
    strokes = [_stroke(color) for color in colors]
    faces = [_visible(color) for color in colors]
    circles = PolyCollection(dots, facecolors=faces, edgecolors=strokes, linewidths=0.9)
    _add(axes, circles, _MODELS)
    _add(axes, LineCollection(lines, colors=strokes, linewidths=1.2), _HEADINGS)


def _arrow(pose: Pose, length: float) -> DoubleArray:
    """Returns the vertices of a triangle that points along the x axis of a pose, shape (3, 2)."""
    # Longer than wide, so that the tip can be told from the other vertices.
    return transform_points(pose, length * np.array([(0.6, 0.0), (-0.4, 0.3), (-0.4, -0.3)]))


def _paint_names(axes: Any, models: list[Footprints]) -> None:
    for model in models:
        bounds = model.bounds
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
