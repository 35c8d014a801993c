"""Scans in a world with glass and mirrors, compared with scans of the same world without them."""

from __future__ import annotations

import itertools
import math

import flatland
from flatland import Material
from flatland.physics import PhysicsBody
from flatland.plugins.laser import Laser

from scenes import benchmark_world_path, scan_pose  # isort: skip
from table import Row
from timing import best_pair

PANES = 12
BAR = 2.0


def _panes(world: flatland.World, distance: float) -> list[PhysicsBody]:
    """Adds a ring of edges around the first model, each 30 degrees wide."""
    x, y, _ = scan_pose(world)
    corners = [
        (x + distance * math.cos(angle), y + distance * math.sin(angle))
        for angle in (2 * math.pi * index / PANES for index in range(PANES + 1))
    ]
    panes = []
    for first, second in itertools.pairwise(corners):
        body = world.physics.create_body("static", (0, 0, 0))
        body.create_edges([[*first, *second]])
        panes.append(body)
    return panes


def _row(name: str, materials: list[Material | None]) -> Row:
    """Compares scans with and without materials.

    Args:
        name: Name of the row.
        materials: Materials of successive panes of the ring, repeated; None for no pane. Without
            any, the walls of the map have a material.
    """
    path = benchmark_world_path()
    with (
        flatland.World.from_yaml(path, seed=1) as plain,
        flatland.World.from_yaml(path, seed=1) as other,
    ):
        lasers = []
        for world in (plain, other):
            if materials:
                for index, pane in enumerate(_panes(world, 2.0)):
                    material = materials[index % len(materials)]
                    if material is None:
                        pane.destroy()
                    elif world is other:
                        pane.set_material(material)
            elif world is other:
                for layer in world.layers:
                    layer.body.set_material(Material(reflectance=0.8))
            world.step()
            lasers.append(next(p for p in world.models[0].plugins if isinstance(p, Laser)))
        before, after = best_pair(lasers[0].compute_ranges, lasers[1].compute_ranges)
        beams = lasers[0].angles.count
    note = f"{after * 1e6:.1f} µs and {before * 1e6:.1f} µs, {beams} beams"
    return Row(name, after / before, "plain scans", BAR, note=note)


def rows(_unit: float) -> list[Row]:
    """Measures scans with intensities of walls, glass, and mirrors."""
    glass = Material(reflectance=0.2, transmission=0.8, specular=0.05)
    mirror = Material(specular=0.95)
    return [
        _row("scan with materials: walls with a reflectance", []),
        _row(
            "scan with materials: a glass pane and a mirror",
            [glass, None, None, mirror, *[None] * 8],
        ),
        _row("scan with materials: a third glass, a third mirrors", [glass, mirror, None]),
        _row("scan with materials: glass all around", [glass]),
    ]
