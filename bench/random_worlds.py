"""Random worlds of the default size: generation, and loading of the files.

`python bench/random_worlds.py [SEEDS]` generates that many worlds of each kind (100 by default) and
counts those in which a disc does not reach all free places.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from table import Row

import flatland
from flatland import worldgen

BARS: Final = {"office": 150.0, "maze": 30.0, "warehouse": 45.0}  # U
LOADING_BAR: Final = 10.0  # U
SEEDS: Final = 100
RUNS: Final = 5


def _processor_time(action: Callable[[], object]) -> float:
    """Returns the least processor time of a long action [s], which other programs interrupt."""
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        action()
        times.append(time.process_time() - start)
    return min(times)


def rows(unit: float) -> list[Row]:
    """Measures one world of each kind."""
    result = []
    for kind in worldgen.KINDS:
        generated = _processor_time(lambda kind=kind: worldgen.generate(kind, 1))
        result.append(
            Row(
                f"random {kind} of 60 x 25 m, generated",
                generated / unit,
                "U",
                BARS[kind],
                note=f"{generated * 1e3:.0f} ms",
            )
        )
    with tempfile.TemporaryDirectory() as folder:
        path = worldgen.office(1).write(Path(folder) / "office")
        loaded = _processor_time(lambda: flatland.World.from_yaml(path, seed=1).close())
    name, note = "the random office, loaded from its files", f"{loaded * 1e3:.0f} ms"
    return [*result, Row(name, loaded / unit, "U", LOADING_BAR, note=note)]


def _regions(mask: Any) -> int:
    return int(cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)[0]) - 1


def _is_reached(world: worldgen.RandomWorld) -> bool:
    """Returns whether all free cells, and all cells at whose centres a disc fits, are connected."""
    free = np.pad(world.grid.cells == 0, 1).astype(np.uint8)
    distances = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    fits = (distances - 0.5) * world.grid.resolution >= world.radius - 1e-6
    return _regions(free) == 1 and _regions(fits) == 1


def main(seeds: int) -> int:
    """Generates and checks worlds; returns the exit code."""
    failures = 0
    for kind in worldgen.KINDS:
        start = time.process_time()
        worlds = (worldgen.generate(kind, seed) for seed in range(seeds))
        failed = [world.seed for world in worlds if not _is_reached(world)]
        each = (time.process_time() - start) / seeds
        print(f"{kind}: {seeds} seeds, {len(failed)} not connected {failed}, {each:.3f} s each")
        failures += len(failed)
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS))
