"""The models of people: a disc for the body, and two for the legs."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flatland.geometry import DoubleArray
    from flatland.plugins._people_config import Group, Legs

BODY = "body"
LEGS = ("left_leg", "right_leg")
_LEG_COLOR = (0.15, 0.15, 0.2, 1.0)


def model_text(
    group: Group, legs: Legs | None, layers: list[str], body_type: str, mass: float
) -> str:
    """Returns the YAML text of the model of a person.

    Args:
        group: Group of the person.
        legs: The legs, None for people without legs.
        layers: Layers of the body.
        body_type: Type of the body; legs are always kinematic.
        mass: Mass of the body [kg].
    """
    disc = {
        "type": "circle",
        "radius": group.radius,
        "density": mass / (math.pi * group.radius**2),
        "layers": layers,
        "collision": bool(layers),
    }
    bodies = [{"name": BODY, "type": body_type, "color": group.color, "footprints": [disc]}]
    if legs is not None:
        foot = {
            "type": "circle",
            "radius": legs.radius,
            "density": 1.0,
            "layers": legs.layers,
            # A kinematic leg that collides would make a person immovable whose body can be pushed.
            "collision": body_type == "kinematic",
        }
        for name, side in zip(LEGS, (0.5, -0.5), strict=True):
            pose = [0.0, side * legs.spacing, 0.0]
            bodies.append(
                {
                    "name": name,
                    "type": "kinematic",
                    "pose": pose,
                    "color": _LEG_COLOR,
                    "footprints": [foot],
                }
            )
    return json.dumps({"class": "person", "bodies": bodies})


def parties_of(places: DoubleArray, size: int) -> list[list[int]]:
    """Divides places into parties of neighbours.

    Args:
        places: Positions [m], shape (n, 2).
        size: Number of places in a party; the last one may be smaller.

    Returns:
        The indices of the places of each party.
    """
    remaining = list(range(len(places)))
    parties = []
    while remaining:
        first = remaining[0]
        distances = np.hypot(*(places[remaining] - places[first]).T)
        nearest = np.argsort(distances, kind="stable")[:size]
        party = [remaining[i] for i in nearest]
        parties.append(party)
        remaining = [i for i in remaining if i not in party]
    return parties


def preferred_speeds(group: Group, count: int, rng: np.random.Generator) -> DoubleArray:
    """Draws preferred speeds from a normal distribution, clipped at both ends.

    Returns:
        Speeds within three standard deviations of the mean, and of at least 0.1 m/s, shape
        (count,).
    """
    mean, deviation = group.speed
    speeds = rng.normal(mean, deviation, count)
    least = max(min(0.1, mean), mean - 3.0 * deviation)
    result: DoubleArray = np.clip(speeds, least, mean + 3.0 * deviation)
    return result
