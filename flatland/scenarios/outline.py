"""The walls and models of a world as lines, for pictures of runs."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.geometry import circle_points, transform_points

if TYPE_CHECKING:
    from flatland.entities.body import Body
    from flatland.world import World

Line = list[tuple[float, float]]

Drawn = tuple[str, str, list[Line]]
"""Name of a model, its role and its outlines [m]; the role is `robot`, `hit` or `model`."""


@dataclass(frozen=True, slots=True)
class Outline:
    """The walls of a world.

    Attributes:
        key: Hash of the lines; equal for equal walls.
        lines: Connected points of walls [m].
    """

    key: str
    lines: list[Line]


_CIRCLE_CORNERS: Final = 16


def outline_of(world: World) -> Outline:
    """Returns the walls of all layers, each edge once, rounded to 1 cm."""
    edges: dict[tuple[tuple[float, float], tuple[float, float]], None] = {}
    for layer in world.layers:
        for x1, y1, x2, y2 in np.round(layer.world_edges, 2).tolist():
            a, b = (x1, y1), (x2, y2)
            if a != b and (b, a) not in edges:
                edges[a, b] = None
    lines: list[Line] = []
    for a, b in edges:
        if lines and lines[-1][-1] == a:
            lines[-1].append(b)
        else:
            lines.append([a, b])
    digest = hashlib.sha256(repr(lines).encode()).hexdigest()[:16]
    return Outline(digest, lines)


def models_of(world: World, robot: str, hit: Collection[str]) -> list[Drawn]:
    """Returns the outlines of all models at their current poses, rounded to 1 cm.

    Args:
        world: The world.
        robot: Name of the robot.
        hit: Names of the models that the robot has touched.
    """
    drawn: list[Drawn] = []
    for model in world.models:
        lines = [line for body in model.bodies for line in _shapes(body)]
        role = "robot" if model.name == robot else "hit" if model.name in hit else "model"
        if lines:
            drawn.append((model.name, role, lines))
    return drawn


def _shapes(body: Body) -> Iterator[Line]:
    for fixture in body.fixtures:
        if fixture.is_sensor:
            continue
        if fixture.shape == "circle":
            points = circle_points(fixture.center, fixture.radius, _CIRCLE_CORNERS)
        else:
            points = fixture.vertices
        corners = [(x, y) for x, y in np.round(transform_points(body.pose, points), 2).tolist()]
        yield [*corners, corners[0]]
