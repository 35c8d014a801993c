"""Layers, the static geometry of a world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flatland.entities.body import Body, Color, Entity
from flatland.geometry import DoubleArray, FloatArray, Pose, transform_points
from flatland.physics import PhysicsWorld

WALL_FRICTION = 0.2  # default of Box2D fixtures


class Layer(Entity):
    """Static geometry with one or several names, each of which has a category bit.

    Attributes:
        name: First name of the layer.
        names: All names of the layer.
        category_bits: Bits of all names, used as category and mask of the fixtures.
        color: Color for drawings as (r, g, b, a), each in [0, 1].
        properties: Entry `properties` of the world file, used for drawings.
        body: Static body at the origin of the layer.
        exact_edge_count: Number of edges of the map before simplification.
        unknown_map_keys: Keys of the map file that flatland does not use, sorted.
        map_path: The map file; empty for a layer without a map.
    """

    def __init__(
        self,
        physics: PhysicsWorld,
        names: list[str],
        category_bits: int,
        color: Color,
        properties: dict[str, Any],
        *,
        origin: Pose = (0.0, 0.0, 0.0),
        edges: FloatArray | None = None,
        exact_edge_count: int = 0,
        unknown_map_keys: Sequence[str] = (),
        map_path: str = "",
    ) -> None:
        """Creates the body of the layer and its edges.

        Args:
            physics: Physics world of the body.
            names: Names of the layer, at least one.
            category_bits: Bits of all names.
            color: Color for drawings as (r, g, b, a), each in [0, 1].
            properties: Entry `properties` of the world file.
            origin: Pose of the body in the world frame [m, rad].
            edges: Edges (x1, y1, x2, y2) in the frame of the body [m], shape (n, 4).
            exact_edge_count: Number of edges of the map before simplification.
            unknown_map_keys: Keys of the map file that flatland does not use.
            map_path: The map file; empty for a layer without a map.
        """
        self.name = names[0]
        self.names = list(names)
        self.category_bits = category_bits
        self.color = color
        self.properties = properties
        self.exact_edge_count = exact_edge_count
        self.unknown_map_keys = tuple(unknown_map_keys)
        self.map_path = map_path
        self.body = Body(physics.create_body("static", origin), self, self.name, color)
        if edges is not None and len(edges):
            self.add_edges(edges)

    def __repr__(self) -> str:
        return f"<Layer {self.name!r}>"

    def renew(self, new: Layer) -> None:
        """Becomes equal to a layer that has been loaded again and replaces this one."""
        vars(self).update(vars(new))
        self.body.entity = self

    @property
    def edges(self) -> FloatArray:
        """All edges (x1, y1, x2, y2) in the frame of the body [m], shape (n, 4)."""
        return self.body.edges()

    @property
    def world_edges(self) -> DoubleArray:
        """All edges (x1, y1, x2, y2) in the world frame [m], shape (n, 4)."""
        p_layer = self.edges.astype(np.float64).reshape(-1, 2)
        return transform_points(self.body.pose, p_layer).reshape(-1, 4)

    def add_edges(self, edges: FloatArray) -> None:
        """Adds two-sided edges (x1, y1, x2, y2) in the frame of the body [m], shape (n, 4)."""
        self.body.create_edges(
            edges,
            friction=WALL_FRICTION,
            category_bits=self.category_bits,
            mask_bits=self.category_bits,
        )
