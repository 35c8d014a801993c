"""Drawings of markers as seen from above."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from flatland.geometry import DoubleArray
from flatland.node.adapters.marker import Marker
from flatland.node.foreign_topics.poses import matrix_of, points_of
from flatland.node.foreign_topics.trees import nanoseconds_of
from flatland.node.frame_tree import FrameTree, NoTransformError
from flatland.node.shapes import (
    UNIT_BOX,
    UNIT_CYLINDER,
    Shapes,
    colors_of,
    limited,
    packed_colors,
    transformed,
)
from flatland.web.foreign_topics import Colors, Drawing

MAX_MARKERS: Final = 10_000  # of a topic
_ORIGIN: Final = np.zeros((1, 3))


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """A marker.

    Attributes:
        frame: Its frame.
        shapes: Its shapes in this frame.
        lifetime: ROS times at which it was received and disappears [ns], None if it does not.
        omitted: Why it is not drawn; empty if it is.
    """

    frame: str
    shapes: Shapes
    lifetime: tuple[int, int] | None
    omitted: str


class MarkerDrawer:
    """Draws the markers of a topic that have been added and neither deleted nor expired.

    Attributes:
        note: Which markers are not drawn.
    """

    def __init__(self) -> None:
        """Creates a drawer without markers."""
        self.note = ""
        self._shown: dict[tuple[str, int], _Shown] = {}
        self._has_received = False
        self._changed = False
        self._matrices: dict[str, DoubleArray] = {}  # of the last drawing

    def receive(self, message: Any, now: int) -> None:
        """Takes a `Marker` or a `MarkerArray`."""
        self._has_received = self._changed = True
        for marker in message.markers if hasattr(message, "markers") else [message]:
            self._apply(marker, now)

    def _apply(self, marker: Any, now: int) -> None:
        key = (marker.ns, marker.id)
        if marker.action == Marker.DELETEALL:
            self._shown.clear()
        elif marker.action == Marker.DELETE:
            self._shown.pop(key, None)
        elif key in self._shown or len(self._shown) < MAX_MARKERS:
            duration = nanoseconds_of(marker.lifetime)
            lifetime = (now, now + duration) if duration > 0 else None
            omitted = ""
            shapes = Shapes()
            if marker.type not in _CONVERTERS:
                omitted = "mesh" if marker.type == Marker.MESH_RESOURCE else "unknown type"
            elif marker.color.a <= 0 and not marker.colors:
                omitted = "opacity 0"
            else:
                _CONVERTERS[marker.type](marker, shapes)
            self._shown[key] = _Shown(marker.header.frame_id, shapes, lifetime, omitted)

    def draw(self, frames: FrameTree, now: int, *, again: bool) -> Drawing | None:
        """Returns the drawing if a marker or a transform has changed.

        Markers whose frame is not connected to the world frame are omitted.

        Raises:
            NoTransformError: This applies to all markers.
        """
        if not self._has_received:
            return None
        # Also before its start: the time was set back, by a reset of the world for example.
        ended = [
            key
            for key, each in self._shown.items()
            if each.lifetime is not None and not each.lifetime[0] <= now <= each.lifetime[1]
        ]
        for key in ended:
            del self._shown[key]
        matrices: dict[str, DoubleArray] = {}
        errors = Counter(each.omitted for each in self._shown.values() if each.omitted)
        for frame in {each.frame for each in self._shown.values()}:
            try:
                matrices[frame] = frames.to_root(frame)
            except NoTransformError as error:
                errors[str(error)] += sum(each.frame == frame for each in self._shown.values())
                last_error = error
        if self._shown and not matrices:
            raise last_error
        self.note = "; ".join(
            f"{count} {'marker' if count == 1 else 'markers'} not shown: {reason}"
            for reason, count in sorted(errors.items())
        )
        is_same = self._matrices.keys() == matrices.keys() and all(
            np.array_equal(matrix, self._matrices[frame]) for frame, matrix in matrices.items()
        )
        if is_same and not (again or self._changed or ended):
            return None
        self._changed, self._matrices = False, matrices
        return self._drawing(matrices)

    def _drawing(self, matrices: dict[str, DoubleArray]) -> Drawing:
        combined = Shapes()
        for frame, matrix in matrices.items():
            of_frame = Shapes()
            for each in self._shown.values():
                if each.frame == frame:
                    of_frame.extend(each.shapes)
            combined.extend(of_frame.moved(matrix))
        return combined.projected(np.eye(4))


def _colors(marker: Any, count: int) -> Colors:
    """Returns the colour of each point, or that of the marker for all, shape (count, 4)."""
    if marker.colors and len(marker.colors) == count:
        return packed_colors([(c.r, c.g, c.b, c.a) for c in marker.colors])
    c = marker.color
    return colors_of((c.r, c.g, c.b, c.a), count)


def _placed_points(marker: Any) -> DoubleArray:
    return transformed(matrix_of(marker.pose), points_of(marker.points))


def _scale(marker: Any) -> DoubleArray:
    return limited((marker.scale.x, marker.scale.y, marker.scale.z))


def _arrow(marker: Any, shapes: Shapes) -> None:
    x, y, z = _scale(marker)
    if len(marker.points) >= 2:
        start, end = _placed_points(marker)[:2]
        sizes = (x, y, z)
    else:
        start, end = transformed(matrix_of(marker.pose), ((0, 0, 0), (x, 0, 0)))
        sizes = (y / 2, y, 0.0)
    shapes.add_arrows(start[None], end[None], sizes, _colors(marker, 1))


def _solids(marker: Any, shapes: Shapes, unit: DoubleArray, centers: DoubleArray) -> None:
    """Adds solids of the size of a marker around points in its frame, shape (n, 3)."""
    corners = centers[:, None, None, :] + unit * _scale(marker)
    placed = transformed(matrix_of(marker.pose), corners)
    colors = np.repeat(_colors(marker, len(centers)), len(unit), axis=0)
    shapes.add_triangles(placed.reshape(-1, 3, 3), colors, closed=True)


def _discs(marker: Any, shapes: Shapes, points: DoubleArray) -> None:
    """Adds discs around points in the frame of the message, shape (n, 3)."""
    shapes.add_lines(points, points, marker.scale.x, _colors(marker, len(points)))


def _cube(marker: Any, shapes: Shapes) -> None:
    _solids(marker, shapes, UNIT_BOX, _ORIGIN)


def _cubes(marker: Any, shapes: Shapes) -> None:
    _solids(marker, shapes, UNIT_BOX, points_of(marker.points))


def _sphere(marker: Any, shapes: Shapes) -> None:
    if marker.scale.x == marker.scale.y:
        _discs(marker, shapes, transformed(matrix_of(marker.pose), _ORIGIN))
    else:
        # The outline of an ellipsoid with a vertical axis is that of a cylinder.
        _solids(marker, shapes, UNIT_CYLINDER, _ORIGIN)


def _cylinder(marker: Any, shapes: Shapes) -> None:
    _solids(marker, shapes, UNIT_CYLINDER, _ORIGIN)


def _points(marker: Any, shapes: Shapes) -> None:
    _discs(marker, shapes, _placed_points(marker))


def _line_strip(marker: Any, shapes: Shapes) -> None:
    points = _placed_points(marker)
    colors = _colors(marker, len(points))[:-1]
    shapes.add_lines(points[:-1], points[1:], marker.scale.x, colors)


def _line_list(marker: Any, shapes: Shapes) -> None:
    points = _placed_points(marker)
    count = len(points) // 2
    colors = _colors(marker, len(points))[: 2 * count : 2]
    shapes.add_lines(points[: 2 * count : 2], points[1 : 2 * count : 2], marker.scale.x, colors)


def _triangles(marker: Any, shapes: Shapes) -> None:
    points = transformed(matrix_of(marker.pose), points_of(marker.points) * _scale(marker))
    count = len(points) // 3
    has_color_of_each = len(marker.colors) == count
    colors = _colors(marker, count if has_color_of_each else len(points))
    if not has_color_of_each:
        colors = colors[: 3 * count : 3]
    shapes.add_triangles(points[: 3 * count].reshape(-1, 3, 3), colors)


def _text(marker: Any, shapes: Shapes) -> None:
    shapes.add_text(transformed(matrix_of(marker.pose), _ORIGIN)[0], marker.text)


_CONVERTERS: Final = {
    Marker.ARROW: _arrow,
    Marker.CUBE: _cube,
    Marker.SPHERE: _sphere,
    Marker.CYLINDER: _cylinder,
    Marker.LINE_STRIP: _line_strip,
    Marker.LINE_LIST: _line_list,
    Marker.CUBE_LIST: _cubes,
    Marker.SPHERE_LIST: _points,
    Marker.POINTS: _points,
    Marker.TEXT_VIEW_FACING: _text,
    Marker.TRIANGLE_LIST: _triangles,
}
