"""Random worlds: offices, mazes and warehouses in which every free place can be reached."""

from __future__ import annotations

from flatland.worldgen.random_world import (
    DEFAULT_RADIUS,
    DEFAULT_RESOLUTION,
    DEFAULT_SIZE,
    KINDS,
    RandomWorld,
    generate,
)

__all__ = ["KINDS", "RandomWorld", "generate", "maze", "office", "warehouse"]


def office(
    seed: int,
    size: tuple[float, float] = DEFAULT_SIZE,
    *,
    resolution: float = DEFAULT_RESOLUTION,
    radius: float = DEFAULT_RADIUS,
) -> RandomWorld:
    """Generates an office: rows of furnished rooms along corridors; see `generate`."""
    return generate("office", seed, size, resolution=resolution, radius=radius)


def maze(
    seed: int,
    size: tuple[float, float] = DEFAULT_SIZE,
    *,
    resolution: float = DEFAULT_RESOLUTION,
    radius: float = DEFAULT_RADIUS,
) -> RandomWorld:
    """Generates a maze with several ways and a few clearings; see `generate`."""
    return generate("maze", seed, size, resolution=resolution, radius=radius)


def warehouse(
    seed: int,
    size: tuple[float, float] = DEFAULT_SIZE,
    *,
    resolution: float = DEFAULT_RESOLUTION,
    radius: float = DEFAULT_RADIUS,
) -> RandomWorld:
    """Generates a warehouse: racks along aisles, docks and a small office; see `generate`."""
    return generate("warehouse", seed, size, resolution=resolution, radius=radius)
