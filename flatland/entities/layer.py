"""Layers: the static geometry of a world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flatland.entities.body import Body, Color, Entity
from flatland.geometry import FloatArray, Pose
from flatland.physics import PhysicsWorld

WALL_FRICTION = 0.2  # the default of a Box2D fixture


class Layer(Entity):
    """Static geometry with one name or several, each with a collision bit.

    Attributes:
        name: The first name.
        names: All names.
        category_bits: Bits of all names, category and mask of the layer's fixtures.
        color: (r, g, b, a), each 0 to 1, for pictures.
        properties: What the file says under `properties`, for pictures.
        body: The static body at the layer's origin.
        exact_edge_count: Edges that the map has before it is simplified.
        unknown_map_keys: Keys of the map file that flatland does not use, sorted.
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
    ) -> None:
        """Makes the layer's body and its edges.

        Args:
            physics: World to make them in.
            names: The layer's names, at least one.
            category_bits: Bits of all names.
            color: For pictures.
            properties: For pictures.
            origin: Pose of the layer's body in the world frame.
            edges: Edges (x1, y1, x2, y2) in the body's frame [m], shape (n, 4).
            exact_edge_count: Edges before the map was simplified.
            unknown_map_keys: Keys of the map file that flatland does not use.
        """
        self.name = names[0]
        self.names = list(names)
        self.category_bits = category_bits
        self.color = color
        self.properties = properties
        self.exact_edge_count = exact_edge_count
        self.unknown_map_keys = tuple(unknown_map_keys)
        self.body = Body(physics.create_body("static", origin), self, self.name, color)
        if edges is not None and len(edges):
            self.add_edges(edges)

    def __repr__(self) -> str:
        """Names the layer."""
        return f"<Layer {self.name!r}>"

    @property
    def edges(self) -> FloatArray:
        """All edges (x1, y1, x2, y2) in the layer body's frame [m], shape (n, 4)."""
        return self.body.edges()

    def add_edges(self, edges: FloatArray) -> None:
        """Adds two-sided edges, in the layer body's frame [m], shape (n, 4)."""
        self.body.create_edges(
            edges,
            friction=WALL_FRICTION,
            category_bits=self.category_bits,
            mask_bits=self.category_bits,
        )
