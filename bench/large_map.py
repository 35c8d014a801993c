"""Loading of a map of 10 000 x 10 000 pixels, tiled from the benchmark map, in a new process."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import yaml

from scenes import benchmark_world_path  # isort: skip
from table import Row

SIDE = 10_000  # pixels
RUNS = 3

# Prints the loading time [s], the time of the first step [s], the peak memory [MB] and the edges.
LOAD = r"""
import json, re, sys, time
import flatland
start = time.perf_counter()
world = flatland.World.from_yaml(sys.argv[1], seed=1)
loaded = time.perf_counter()
world.step()
stepped = time.perf_counter()
# getrusage would include the memory of the parent process before exec.
peak = int(re.search(r"VmHWM:\s+(\d+) kB", open("/proc/self/status").read())[1]) / 1024
print(json.dumps([loaded - start, stepped - loaded, peak, len(world.layers[0].edges)]))
"""


def write_world(folder: Path, side: int) -> Path:
    """Writes a world whose map is that of the benchmark world, tiled to a square.

    Args:
        folder: Folder of the new files.
        side: Side of the square [px].

    Returns:
        Path of the world file.
    """
    base = benchmark_world_path()
    map_path = base.parent / yaml.safe_load(base.read_text())["layers"][0]["map"]
    entry = yaml.safe_load(map_path.read_text())
    image = cv2.imread(str(map_path.parent / entry["image"]), cv2.IMREAD_GRAYSCALE)
    times = [-(-side // length) for length in image.shape]
    cv2.imwrite(str(folder / "map.png"), np.tile(image, times)[:side, :side])
    entry["image"] = "map.png"
    (folder / "map.yaml").write_text(yaml.safe_dump(entry))
    (folder / "robot.model.yaml").write_text(
        "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 50}]}]\n"
    )
    world = {
        "properties": {},
        "layers": [{"name": "2d", "map": "map.yaml"}],
        "models": [{"name": "robot", "model": "robot.model.yaml", "pose": [12.0, 0.0, 0.0]}],
    }
    path = folder / "world.yaml"
    path.write_text(yaml.safe_dump(world))
    return path


def load(world: Path) -> tuple[float, float, float, int]:
    """Loads a world in a new process.

    Returns:
        Loading time [s], time of the first step [s], peak memory [MB], number of edges.
    """
    command = [sys.executable, "-c", LOAD, str(world)]
    result = subprocess.run(command, check=True, capture_output=True, text=True)
    loading, stepping, peak, edges = json.loads(result.stdout.splitlines()[-1])
    return loading, stepping, peak, edges


def rows(_unit: float) -> list[Row]:
    """Measures time and memory of loading and the time of the first step."""
    with tempfile.TemporaryDirectory() as folder:
        world = write_world(Path(folder), SIDE)
        runs = [load(world) for _ in range(RUNS)]
    loading, _, _, edges = min(runs)
    stepping = min(run[1] for run in runs)
    peak = max(run[2] for run in runs)
    note = f"{edges} edges; reference simulator: 1.8 to 2.7 s"
    return [
        Row(f"loading of a map of {SIDE} x {SIDE} px", loading, "s", 2.5, note=note),
        Row("peak memory with that map", peak, "MB", 700.0, note="reference simulator: 330 to 450"),
        Row("first step on that map, one robot", stepping, "s"),
    ]
