"""Debug markers of a layer: edges as lines and as walls."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from flatland.entities.layer import Layer
from flatland.geometry import DoubleArray, FloatArray
from flatland.node.adapters.marker import Marker
from flatland.node.markers.marker_geometry import flat, wall_triangles
from flatland.node.markers.model_markers import LINE_WIDTH
from flatland.node.markers.packed_markers import NewWriter, PackedMarkers
from flatland.scene.description import describe_layer

_LOG = logging.getLogger("flatland")

DEFAULT_HEIGHTS: Final = (0.0, 1.0)  # m


class LayerMarkers:
    """Creates the markers of a layer."""

    def __init__(self, layer: Layer, writer: NewWriter) -> None:
        """Reads the height of the walls from the properties of a layer.

        Invalid heights are logged as a warning and replaced by the default.

        Args:
            layer: The layer.
            writer: Creates the writer of a message.
        """
        self._layer = layer
        self._writer = writer
        self._heights = wall_heights(layer)

    def lines(self, time_ns: int) -> PackedMarkers:
        """Returns the edges as lines; no marker for a layer without edges.

        Args:
            time_ns: Stamp of the markers, simulated time [ns].
        """
        return self._message(time_ns, Marker.LINE_LIST, flat, LINE_WIDTH)

    def walls(self, time_ns: int) -> PackedMarkers:
        """Returns the edges as walls; no marker for a layer without edges.

        Args:
            time_ns: Stamp of the markers, simulated time [ns].
        """
        walls = partial(wall_triangles, min_z=self._heights[0], max_z=self._heights[1])
        return self._message(time_ns, Marker.TRIANGLE_LIST, walls, (1.0, 1.0, 1.0), locked=True)

    def _message(
        self,
        time_ns: int,
        kind: int,
        points: Callable[[FloatArray], DoubleArray],
        scale: tuple[float, float, float],
        *,
        locked: bool = False,
    ) -> PackedMarkers:
        layer = describe_layer(self._layer)
        markers = PackedMarkers(self._writer, layer.name)
        if len(layer.edges):
            number = markers.add(
                kind, points(layer.edges), scale=scale, color=layer.color, frame_locked=locked
            )
            markers.set_poses([number], layer.pose)
        markers.set_stamp(time_ns)
        return markers


def wall_heights(layer: Layer) -> tuple[float, float]:
    """Returns the lower and upper end of the walls of a layer [m], from its properties.

    Invalid heights are logged as a warning and replaced by the default.
    """
    debug = layer.properties.get("debug")
    if debug is None:
        return DEFAULT_HEIGHTS
    if not isinstance(debug, dict):
        _warn(layer, f"debug must be a map with min_z and max_z, got {debug!r}")
        return DEFAULT_HEIGHTS
    heights = []
    for key, default in zip(("min_z", "max_z"), DEFAULT_HEIGHTS, strict=True):
        value = debug.get(key)
        height = default if value is None else _number(value)
        if height is None:
            _warn(layer, f"{key} must be a finite number, got {value!r}")
            return DEFAULT_HEIGHTS
        heights.append(height)
    min_z, max_z = heights
    if min_z >= max_z:
        _warn(layer, f"min_z must be less than max_z, got {min_z:g} and {max_z:g}")
        return DEFAULT_HEIGHTS
    return min_z, max_z


def _number(value: Any) -> float | None:
    """Converts a value of a YAML file, which may be a string, to a finite number or None."""
    if isinstance(value, bool):
        return None
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def _warn(layer: Layer, problem: str) -> None:
    _LOG.warning(
        'layer "%s", property "debug": %s; using walls from %g to %g m',
        layer.name,
        problem,
        *DEFAULT_HEIGHTS,
    )
