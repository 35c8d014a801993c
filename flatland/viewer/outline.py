"""Outlines of models, read from the model file before the model is spawned."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from flatland.config.reader import YamlReader
from flatland.entities.body import Body, Color
from flatland.entities.collision_filter import ALL_LAYERS, CollisionFilter
from flatland.entities.model import Model
from flatland.geometry import IDENTITY, DoubleArray, circle_points, transform_points
from flatland.loading.model_loader import ModelLoader
from flatland.physics import PhysicsFixture, PhysicsWorld
from flatland.world import World

_CIRCLE_POINTS: Final = 32


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """The edges of one body.

    Attributes:
        color: Color of the body as (r, g, b, a), each in [0, 1].
        segments: Start and end of each edge in the model's frame [m], shape (2 n, 2).
    """

    color: Color
    segments: DoubleArray


class _AnyLayer(CollisionFilter):
    """Accepts every layer name: the layers of the simulator's world are not available here."""

    def unknown(self, _names: Iterable[str]) -> list[str]:
        return []

    def category_bits(self, _names: Iterable[str]) -> int:
        return ALL_LAYERS


def read_outline(
    path: str, params: Callable[[str], object] | None = None, *, name: str = "preview"
) -> list[Outline]:
    """Reads the outlines of the bodies of a model file, with the model at the origin.

    Args:
        path: Path of the model file.
        params: Returns the value of `param(name)` in the file.
        name: Name of the model in error messages.

    Returns:
        One outline for each body that has footprints.

    Raises:
        YamlError: The file cannot be read, or a body or joint in it is invalid.
    """
    with World(seed=0) as world:
        physics = PhysicsWorld()
        try:
            model = Model(world, name, "", path)
            reader = YamlReader.from_file(path, params)
            ModelLoader(physics, _AnyLayer(), model, reader).load_bodies_and_joints(IDENTITY)
            return [Outline(body.color, _segments(body)) for body in model.bodies if body.fixtures]
        finally:
            physics.close()


def max_radius(outlines: Iterable[Outline]) -> float:
    """Returns the greatest distance of a vertex from the model's origin [m], 0 for no outlines."""
    return max((float(np.hypot(*each.segments.T).max()) for each in outlines), default=0.0)


def _segments(body: Body) -> DoubleArray:
    """Returns the edges of all fixtures of a body in the model's frame [m], shape (2 n, 2)."""
    p_body = np.concatenate([_fixture_segments(fixture) for fixture in body.fixtures])
    return transform_points(body.pose, p_body)


def _fixture_segments(fixture: PhysicsFixture) -> DoubleArray:
    """Returns the edges of a circle or polygon in the body's frame [m], shape (2 n, 2)."""
    if fixture.shape == "circle":
        points = circle_points(fixture.center, fixture.radius, _CIRCLE_POINTS)
    else:
        points = np.asarray(fixture.vertices, dtype=np.float64)
    segments: DoubleArray = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
    return segments.reshape(-1, 2)
