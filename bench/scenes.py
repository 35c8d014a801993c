"""Worlds, maps and beams that several modules use."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np

import flatland
from flatland.physics import PhysicsWorld

CHECKOUT = Path(__file__).resolve().parent.parent
BEAMS = 1081
RANGE = 20.0
BAR_WORLD = "benchmark_world"  # of the reference simulator; a scan in the office takes less time


def shared_dir() -> Path | None:
    """Returns the folder with the worlds of the reference simulator, None if it is missing."""
    folder = Path(os.environ.get("FLATLAND_SHARED_DIR", CHECKOUT.parent / "shared"))
    return folder if (folder / "worlds").is_dir() else None


def benchmark_world_path() -> Path:
    """Returns the benchmark world of the reference simulator, or the bundled office."""
    shared = shared_dir()
    if shared is None:
        return CHECKOUT / "worlds" / "office" / "world.yaml"
    return shared / "worlds" / BAR_WORLD / "world.yaml"


def scan_pose(world: flatland.World) -> tuple[float, float, float]:
    """Returns the pose of the scans in the world frame, that of the first model."""
    return world.models[0].pose


def beam_ends(beams: int = BEAMS, length: float = RANGE) -> np.ndarray:
    """Returns the end points of a 270° laser in its frame [m], shape (beams, 2)."""
    angles = np.linspace(-0.75 * math.pi, 0.75 * math.pi, beams)
    ends = length * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.ascontiguousarray(ends, dtype=np.float32)


def random_map(side: int, edges: int, seed: int = 1) -> np.ndarray:
    """Returns a square map of randomly placed boxes.

    Args:
        side: Side of the map [px].
        edges: Approximate number of edges.
        seed: Seed of the random numbers.

    Returns:
        Whether each pixel is free, shape (side, side).
    """
    rng = np.random.default_rng(seed)
    free = np.ones((side, side), dtype=bool)
    for _ in range(edges // 4):
        row, column = rng.integers(0, side - 8, 2)
        height, width = rng.integers(2, 8, 2)
        free[row : row + height, column : column + width] = False
    centre = side // 2
    free[centre - 20 : centre + 20, centre - 20 : centre + 20] = True
    return free


def world_of_edges(edges: np.ndarray) -> PhysicsWorld:
    """Creates a physics world with one static body that consists of edges."""
    world = PhysicsWorld()
    body = world.create_body("static", (0.0, 0.0, 0.0))
    body.create_edges(edges, category_bits=1, mask_bits=1)
    return world
