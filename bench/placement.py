"""Free places: drawing poses for a fleet, and the nearest free place of a blocked model."""

from __future__ import annotations

import flatland

from scenes import benchmark_world_path, scan_pose  # isort: skip
from table import Row
from timing import best_of

POSES = 50


def rows(unit: float) -> list[Row]:
    """Measures on the benchmark world, once what does not change is cached."""
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        x, y, _ = scan_pose(world)
        sampled = best_of(lambda: world.sample_free(POSES, 0.3, 0.1, rng=1, connected_to=(x, y)))
        model, edge = world.models[0], world.layers[0].edges[0]
        origin = world.layers[0].body.pose
        wall = (origin[0] + float(edge[0]), origin[1] + float(edge[1]), 0.0)
        moved = best_of(lambda: world.move_model(model.name, wall, if_blocked="nearest"))
    return [
        Row(
            f"{POSES} free poses that are connected, benchmark world",
            sampled / unit,
            "U",
            40.0,
            note=f"{sampled * 1e3:.1f} ms",
        ),
        Row(
            "a model moved onto a wall, if_blocked nearest",
            moved / unit,
            "U",
            10.0,
            note=f"{moved * 1e3:.2f} ms",
        ),
    ]
