"""Resets, snapshots and clones of the office."""

from __future__ import annotations

import gc
from pathlib import Path

from table import Row
from timing import best_of

import flatland

OFFICE = Path(__file__).resolve().parents[1] / "worlds" / "office" / "world.yaml"
CLONES = 50
PAGE = 4096  # bytes


def _resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def _bytes_of_a_clone(world: flatland.World) -> float:
    world.clone().close()
    gc.collect()
    before = _resident_bytes()
    clones = [world.clone() for _ in range(CLONES)]
    used = (_resident_bytes() - before) / CLONES
    for clone in clones:
        clone.close()
    return used


def rows(unit: float) -> list[Row]:
    """Measures the office with one robot."""
    with flatland.World.from_yaml(OFFICE, seed=1) as world:
        world.delete_model("tricycle")
        world.command("/cmd_vel").set(flatland.Twist(linear_x=0.5))
        world.output("/scan")
        world.step(40)
        snapshot = world.snapshot()

        def restore() -> None:
            world.restore(snapshot)

        def clone() -> None:
            world.clone().close()

        times = [
            ("state of all models", best_of(world.state, 0.3, 3), None),
            ("snapshot of the office, one robot", best_of(world.snapshot, 0.5, 3), 1.0),
            ("restore of the office, one robot", best_of(restore, 0.5, 3), 1.0),
            ("clone and close of the office, one robot", best_of(clone, 1.0, 3), 5.0),
            ("reset of the office, two robots", best_of(world.reset, 2.0, 3), 20.0),
        ]
        memory = _bytes_of_a_clone(world)
    found = [
        Row(name, seconds * 1e3, "ms", bar, note=f"{seconds / unit:.3g} U")
        for name, seconds, bar in times
    ]
    return [*found, Row("memory of a clone of the office", memory / 1e6, "MB", 3.0)]
