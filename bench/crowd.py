"""Generated worlds of many robots with a differential drive and a laser."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import yaml

import flatland

from scenes import benchmark_world_path  # isort: skip

CLEARANCE = 0.5  # minimum distance of a robot from the walls [m]
SPACING = 0.9  # minimum distance of two robots [m]
MAX_ROBOTS = 100
GRID = 5.0  # m between the robots of a grid

ROBOT = """
bodies:
  - name: base
    footprints: [{{type: circle, radius: 0.2, density: 50}}]
plugins:
  - {{type: DiffDrive, name: drive, body: base, pub_rate: 50}}
  - {{type: Laser, name: laser, body: base, range: 20, update_rate: 10,
     always_publish: {scans}, noise_std_dev: 0.01,
     angle: {{min: -3.141592653589793, max: 3.13, increment: 0.017453292519943295}}}}
"""


def free_positions(world_path: Path, count: int) -> list[tuple[float, float]]:
    """Returns random free positions in a world that are reachable from its first model.

    The positions do not change from run to run.

    Args:
        world_path: World file whose first layer is an image map.
        count: Number of positions.

    Returns:
        Positions (x, y) in the world frame [m].

    Raises:
        ValueError: The world has room for fewer robots.
    """
    world = yaml.safe_load(world_path.read_text())
    map_path = world_path.parent / world["layers"][0]["map"]
    entry = yaml.safe_load(map_path.read_text())
    image = cv2.imread(str(map_path.parent / entry["image"]), cv2.IMREAD_GRAYSCALE)
    resolution, (left, bottom, _) = entry["resolution"], entry["origin"]
    is_free = (image > 255 * (1 - entry["free_thresh"])).astype(np.uint8)
    has_room = cv2.distanceTransform(is_free, cv2.DIST_L2, 5) * resolution > CLEARANCE
    _, labels = cv2.connectedComponents(has_room.astype(np.uint8))
    x, y, _ = world["models"][0]["pose"]
    rows = len(image)
    home = labels[rows - 1 - int((y - bottom) / resolution), int((x - left) / resolution)]
    candidates = np.argwhere(labels == home)
    np.random.default_rng(3).shuffle(candidates)
    found: list[tuple[float, float]] = []
    for row, column in candidates:
        x, y = left + (column + 0.5) * resolution, bottom + (rows - row - 0.5) * resolution
        if all((x - a) ** 2 + (y - b) ** 2 > SPACING**2 for a, b in found):
            found.append((float(x), float(y)))
            if len(found) == count:
                return found
    raise ValueError(f"{world_path} has room for {len(found)} robots, not {count}")


@contextmanager
def crowd_file(which: slice, *, scans: bool) -> Iterator[Path]:
    """Writes a temporary world file with robots on the map of the benchmark world.

    Args:
        which: Selection of the `MAX_ROBOTS` positions. A small selection from the whole range
            has scans of the same average cost as a large one.
        scans: Whether the lasers scan without subscribers.

    Yields:
        Path of the world file, which is removed at the end.
    """
    base = benchmark_world_path()
    positions = free_positions(base, MAX_ROBOTS)[which]
    world = yaml.safe_load(base.read_text())
    for layer in world["layers"]:
        layer["map"] = str(base.parent / layer["map"])
    world["models"] = [
        {
            "name": f"robot{index}",
            "namespace": f"robot{index}",
            "model": "robot.model.yaml",
            "pose": [*position, float(index)],
        }
        for index, position in enumerate(positions)
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.model.yaml").write_text(ROBOT.format(scans=str(scans).lower()))
        (folder / "world.yaml").write_text(yaml.safe_dump(world))
        yield folder / "world.yaml"


@contextmanager
def crowd(which: slice, *, scans: bool) -> Iterator[flatland.World]:
    """Loads a world of `crowd_file`, and drives all robots in circles."""
    with crowd_file(which, scans=scans) as path, flatland.World.from_yaml(path, seed=1) as loaded:
        for index in range(len(loaded.models)):
            turn = flatland.Twist(linear_x=0.2, angular_z=1.0 if index % 2 else -1.0)
            loaded.command(f"/robot{index}/cmd_vel").set(turn)
        loaded.step(200)
        yield loaded


@contextmanager
def grid(count: int, *, scans: bool) -> Iterator[flatland.World]:
    """Loads robots on a grid without walls in the range of their lasers, driving in circles."""
    side = math.ceil(math.sqrt(count))
    models = [
        {
            "name": f"robot{index}",
            "namespace": f"robot{index}",
            "model": "robot.model.yaml",
            "pose": [GRID * (index % side), GRID * (index // side), float(index)],
        }
        for index in range(count)
    ]
    world = {"properties": {}, "layers": [{"name": "2d"}], "models": models}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.model.yaml").write_text(ROBOT.format(scans=str(scans).lower()))
        (folder / "world.yaml").write_text(yaml.safe_dump(world))
        with flatland.World.from_yaml(folder / "world.yaml", seed=1) as loaded:
            for index in range(count):
                turn = flatland.Twist(linear_x=0.2, angular_z=1.0 if index % 2 else -1.0)
                loaded.command(f"/robot{index}/cmd_vel").set(turn)
            loaded.step(200)
            yield loaded
