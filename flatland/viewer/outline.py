"""The outline of a model, read from its file before it is spawned."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.config.reader import YamlReader
from flatland.entities.body import Body, Color
from flatland.entities.collision_filter import ALL_LAYERS, CollisionFilter
from flatland.entities.model import Model
from flatland.geometry import IDENTITY, rotate
from flatland.loading.model_loader import ModelLoader
from flatland.physics import PhysicsFixture, PhysicsWorld
from flatland.world import World

_CIRCLE_POINTS: Final = 32
FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """The edges of one body.

    Attributes:
        color: (r, g, b, a) of the body.
        segments: Start and end of each edge in the model's frame [m], shape (2 n, 2).
    """

    color: Color
    segments: FloatArray


class _AnyLayer(CollisionFilter):
    """Knows every layer: which ones there are is the simulator's affair."""

    def unknown(self, _names: Iterable[str]) -> list[str]:
        return []

    def category_bits(self, _names: Iterable[str]) -> int:
        return ALL_LAYERS


def read_outline(
    path: str, params: Callable[[str], object] | None = None, *, name: str = "preview"
) -> list[Outline]:
    """Reads the outlines of a model's bodies, its first body at the origin as when spawned there.

    Args:
        path: The model file.
        params: What `param()` in the file answers from.
        name: Of the model, for what is said of mistakes in the file.

    Raises:
        YamlError: The file cannot be read, or its bodies or joints are wrong.
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


def reach(outlines: Iterable[Outline]) -> float:
    """Returns the greatest distance of an outline from the model's origin [m]."""
    return max((float(np.hypot(*each.segments.T).max()) for each in outlines), default=0.0)


def _segments(body: Body) -> FloatArray:
    local = np.concatenate([_closed_line(fixture) for fixture in body.fixtures])
    x, y, theta = body.pose
    c, s = rotate((1.0, 0.0), theta)
    turned: FloatArray = local @ np.array([[c, s], [-s, c]])
    turned += np.array([x, y])
    return turned


def _closed_line(fixture: PhysicsFixture) -> FloatArray:
    """Returns the segments around a circle or polygon in the body's frame, shape (2 n, 2)."""
    if fixture.shape == "circle":
        angles = np.linspace(0.0, 2 * np.pi, _CIRCLE_POINTS, endpoint=False)
        points = fixture.radius * np.column_stack([np.cos(angles), np.sin(angles)])
        points += fixture.center
    else:
        points = np.asarray(fixture.vertices, dtype=np.float64)
    segments: FloatArray = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
    return segments.reshape(-1, 2)
