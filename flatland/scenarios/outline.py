"""The walls of a world as lines, for pictures of runs."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flatland.world import World

Line = list[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Outline:
    """The walls of a world.

    Attributes:
        key: Hash of the lines; equal for equal walls.
        lines: Connected points of walls and static models [m].
    """

    key: str
    lines: list[Line]


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
