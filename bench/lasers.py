"""Scans of many lasers: one by one, and in one call on several threads."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import yaml

import flatland
from flatland.plugins.laser import Laser, compute_scans

from curves import Curve, Panel  # isort: skip
from scenes import random_map
from table import Row
from timing import best_of, best_pair

SIDE = 4000  # px of 5 cm
BOXES = 1000
ROBOTS = 1000
DUE = 50  # scans at a time, those of a step if each laser scans at 10 Hz
MARGIN = 5.0  # between the robots and the border of the map [m]
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 50}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20, noise_std_dev: 0.01, broadcast_tf: false,
     angle: {min: -3.141592653589793, max: 3.13, increment: 0.017453292519943295}}
"""
COUNTS = (1, 10, 100, ROBOTS)


@contextmanager
def lasers_on_a_large_map() -> Iterator[list[Laser]]:
    """Loads 1000 robots with a 360-beam laser at random places of a map with few boxes."""
    rng = np.random.default_rng(7)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cv2.imwrite(str(folder / "map.png"), 255 * random_map(SIDE, 4 * BOXES).astype(np.uint8))
        entry = {"image": "map.png", "resolution": 0.05, "origin": [0, 0, 0], "negate": 0}
        thresholds = {"occupied_thresh": 0.65, "free_thresh": 0.196}
        (folder / "map.yaml").write_text(yaml.safe_dump(entry | thresholds))
        (folder / "robot.model.yaml").write_text(ROBOT)
        world = {"properties": {}, "layers": [{"name": "2d", "map": "map.yaml"}], "models": []}
        (folder / "world.yaml").write_text(yaml.safe_dump(world))
        with flatland.World.from_yaml(folder / "world.yaml", seed=1) as loaded:
            for index in range(ROBOTS):
                x, y = rng.uniform(MARGIN, 0.05 * SIDE - MARGIN, 2)
                pose = (float(x), float(y), float(index))
                loaded.spawn_model("robot.model.yaml", f"r{index}", f"r{index}", pose, "allow")
            loaded.step()
            yield [plugin for model in loaded.models for plugin in model.plugins]


def rows(unit: float) -> list[Row]:
    """Measures the scans of some of 1000 robots, one by one and in one call."""
    with lasers_on_a_large_map() as every:
        lasers = every[:DUE]
        single = best_of(lambda: [laser.compute_ranges() for laser in lasers], 2.0)
        batch, parallel = best_pair(
            lambda: compute_scans(lasers, num_threads=1),
            lambda: compute_scans(lasers, num_threads=2),
            4.0,
        )
    found = []
    for name, time, bar in (
        ("one by one", single, 0.03),
        ("in one call, one thread", batch, 0.012),
        ("in one call, two threads", parallel, 0.01),
    ):
        note = f"{1e6 * time / DUE:.1f} µs per scan"
        label = f"scan of 360 beams among {ROBOTS} robots, {DUE} scans {name}"
        found.append(Row(label, time / DUE / unit, "U", bar, note=note))
    return found


def panel() -> Panel:
    """Measures the time per scan over the number of lasers."""
    curves = []
    with lasers_on_a_large_map() as lasers:
        for label, threads in (("one by one", None), ("one thread", 1), ("two threads", 2)):
            times = []
            for count in COUNTS:
                some = lasers[:count]
                if threads is None:
                    time = best_of(lambda some=some: [laser.compute_ranges() for laser in some])
                else:
                    time = best_of(lambda some=some, n=threads: compute_scans(some, num_threads=n))
                times.append(1e6 * time / count)
            curves.append(Curve(label, list(COUNTS), times))
    return Panel("360-beam lasers among 1000 robots", "lasers", "time per scan [µs]", curves)
