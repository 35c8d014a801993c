"""Outlines of models, read from the model file before the model is spawned."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from flatland.drawing.model_preview import bodies_of_file
from flatland.entities.body import Body, Color
from flatland.geometry import DoubleArray, circle_points, transform_points
from flatland.physics import PhysicsFixture

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
    with bodies_of_file(path, params, name=name) as bodies:
        return [Outline(body.color, _segments(body)) for body in bodies if body.fixtures]


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
