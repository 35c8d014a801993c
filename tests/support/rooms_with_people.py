"""Rooms with people, for the tests of Pedestrians."""

from __future__ import annotations

from typing import Any

import flatland
from flatland.plugins.pedestrians import Pedestrians

ROOM = ["##########", "#        #", "#        #", "#        #", "#        #", "##########"]


def people_of(world: flatland.World) -> Pedestrians:
    plugin = world.plugins[0]
    assert isinstance(plugin, Pedestrians)
    return plugin


def load(
    files: Any, groups: str, options: str = "", walls: list[str] | None = None, **more: Any
) -> flatland.World:
    """Loads a world with a map, by default a room of 8 m by 4 m, and people."""
    files.write_map("room", ROOM if walls is None else walls)
    text = (
        "properties: {}\n"
        "layers: [{name: [2d, body], map: room.yaml}]\n"
        f"plugins: [{{name: people, type: Pedestrians, {options}groups: {groups}}}]\n"
    )
    return files.load(text, **more)


ONE = "[{name: a, count: 0, radius: 0.2, speed: 1.2, speed_deviation: 0, waypoints: [{at: %s}]}]"
CALM = "fluctuation: 0, "
DOOR = (
    "bodies:\n  - name: door\n    type: kinematic\n    footprints:\n"
    "      - {type: polygon, density: 0, points:"
    " [[-0.1, -0.5], [0.1, -0.5], [0.1, 0.5], [-0.1, 0.5]]}\n"
)
SHELF = "3 1 3.5 1\n3.5 1 3.5 5\n3.5 5 3 5\n3 5 3 1\n"  # 0.5 m by 4 m
