"""Outlines of models, read from the model file before the model is spawned."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from flatland.config.inputs import Inputs
from flatland.entities.body import Color
from flatland.geometry import DoubleArray, transform_points
from flatland.scene.description import BodyDescription
from flatland.scene.model_preview import describe_file


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
    bodies = describe_file(path, Inputs(params), name=name)
    return [Outline(body.color, _segments(body)) for body in bodies if body.shapes]


def max_radius(outlines: Iterable[Outline]) -> float:
    """Returns the greatest distance of a vertex from the model's origin [m], 0 for no outlines."""
    return max((float(np.hypot(*each.segments.T).max()) for each in outlines), default=0.0)


def _segments(body: BodyDescription) -> DoubleArray:
    """Returns the edges of all fixtures of a body in the model's frame [m], shape (2 n, 2)."""
    p_body = np.concatenate([shape.segments() for shape in body.shapes])
    return transform_points(body.pose, p_body)
