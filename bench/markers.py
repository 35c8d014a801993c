"""Markers of a large layer."""

from __future__ import annotations

from io import BytesIO

import numpy as np

from flatland.entities.layer import Layer
from flatland.node.markers.layer_markers import LayerMarkers
from flatland.physics import PhysicsWorld
from flatland.ros.adapters.writer import RosWriter

from table import Row  # isort: skip
from timing import best_of

EDGES = 50_000


def rows(_unit: float) -> list[Row]:
    """Measures the creation and serialization of the line and wall markers of a layer."""
    edges = np.random.default_rng(1).uniform(-100, 100, (EDGES, 4)).astype(np.float32)
    color = (0.1, 0.2, 0.3, 0.4)
    layer = Layer(PhysicsWorld(), ["walls"], 1, color, {}, origin=(0, 0, 0), edges=edges)

    def build() -> None:
        markers = LayerMarkers(layer, RosWriter)
        for message in (markers.lines(0), markers.walls(0)):
            BytesIO().write(message.packed)

    return [Row(f"markers of a layer of {EDGES} edges", best_of(build, 1.0, 3), "s", 1.0)]
