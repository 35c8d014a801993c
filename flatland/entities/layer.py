"""Layers, the static geometry of a world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from flatland.entities.body import Body, Color, Entity
from flatland.geometry import DoubleArray, FloatArray, Pose, transform_points
from flatland.physics import Material, PhysicsWorld
from flatland.uncopied import uncopied

if TYPE_CHECKING:
    from flatland.values import OccupancyGrid

WALL_FRICTION = 0.2  # default of Box2D fixtures


@uncopied("World.clone() copies a world with its layers")
class Layer(Entity):
    """Static geometry with one or several names, each of which has a category bit.

    Attributes:
        name: First name of the layer.
        names: All names of the layer.
        category_bits: Bits of all names, used as category and mask of the fixtures.
        color: Color for drawings as (r, g, b, a), each in [0, 1].
        properties: Entry `properties` of the world file, used for drawings.
        body: Static body at the origin of the layer.
        material: Material of all walls, including added ones; None for plain walls.
        class_name: Class of objects that the walls belong to, for labels of sensors.
        exact_edge_count: Number of edges of the map before simplification.
        unknown_map_keys: Keys of the map file that flatland does not use, sorted.
        map_path: The map file; empty for a layer without one.
        map_topic: Topic that the map is received from; empty for none.
        grid: The map, if it was given as a grid.
        added_edges: Number of edges that were added, including those too short for the physics.
        map_version: Number of replacements of the map since the layer was loaded.
    """

    def __init__(
        self,
        physics: PhysicsWorld,
        names: list[str],
        category_bits: int,
        color: Color,
        properties: dict[str, Any],
        *,
        material: Material | None = None,
        class_name: str = "",
        origin: Pose = (0.0, 0.0, 0.0),
        edges: FloatArray | None = None,
        exact_edge_count: int = 0,
        unknown_map_keys: Sequence[str] = (),
        map_path: str = "",
        map_topic: str = "",
    ) -> None:
        """Creates the body of the layer and its edges.

        Args:
            physics: Physics world of the body.
            names: Names of the layer, at least one.
            category_bits: Bits of all names.
            color: Color for drawings as (r, g, b, a), each in [0, 1].
            properties: Entry `properties` of the world file.
            material: Material of all walls; None for plain walls.
            class_name: Class of objects that the walls belong to, by default the first name.
            origin: Pose of the body in the world frame [m, rad].
            edges: Edges (x1, y1, x2, y2) in the frame of the body [m], shape (n, 4).
            exact_edge_count: Number of edges of the map before simplification.
            unknown_map_keys: Keys of the map file that flatland does not use.
            map_path: The map file; empty for a layer without one.
            map_topic: Topic that the map is received from; empty for none.
        """
        self.name = names[0]
        self.names = list(names)
        self.category_bits = category_bits
        self.color = color
        self.properties = properties
        self.material = material
        self.class_name = class_name or self.name
        self.exact_edge_count = exact_edge_count
        self.unknown_map_keys = tuple(unknown_map_keys)
        self.map_path = map_path
        self.map_topic = map_topic
        self.grid: OccupancyGrid | None = None
        self.map_version = 0
        self.added_edges = 0
        physics_body = physics.create_body("static", origin)
        self.body = Body(physics_body, self, self.name, color, self.class_name)
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
        self.added_edges += len(edges)
        if self.material is not None:
            self.body.set_material(self.material)
