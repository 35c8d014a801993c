"""Requests: random free poses, the nearest free pose of a blocked model, its appearance."""

from __future__ import annotations

import flatland

from scenes import benchmark_world_path, scan_pose  # isort: skip
from table import Row
from timing import best_of

POSES = 50


def rows(unit: float) -> list[Row]:
    """Measures placement in the benchmark world with warm caches."""
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        x, y, _ = scan_pose(world)
        sampled = best_of(lambda: world.sample_free(POSES, 0.3, 0.1, rng=1, connected_to=(x, y)))
        model, edge = world.models[0], world.layers[0].edges[0]
        origin = world.layers[0].body.pose
        wall = (origin[0] + float(edge[0]), origin[1] + float(edge[1]), 0.0)
        moved = best_of(lambda: world.move_model(model.name, wall, if_blocked="nearest"))
        look = {"color": (0.0, 0.5, 0.0), "layers": [world.layers[0].name], "visible": True}
        painted = best_of(lambda: world.set_appearance(model.name, **look))
    return [
        Row(
            f"{POSES} random free poses in one connected area, benchmark world",
            sampled / unit,
            "U",
            40.0,
            note=f"{sampled * 1e3:.1f} ms",
        ),
        Row(
            "move of a model onto a wall with if_blocked: nearest",
            moved / unit,
            "U",
            10.0,
            note=f"{moved * 1e3:.2f} ms",
        ),
        Row(
            "set_appearance of a model: colour, layers and visibility",
            painted / unit,
            "U",
            0.1,
            note=f"{painted * 1e6:.0f} us",
        ),
    ]
