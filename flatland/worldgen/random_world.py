"""Random worlds: a floor plan, a robot, and the files of the world."""

from __future__ import annotations

import importlib.resources
import json
import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from flatland.checks import (
    check_choice,
    checked_count,
    checked_path,
    checked_range,
    plain_numbers,
    shown,
)
from flatland.errors import WorldError
from flatland.geometry import BoolArray, Pose
from flatland.maps.occupancy_grid import FREE as FREE_CELL
from flatland.maps.occupancy_grid import OCCUPIED
from flatland.values import OccupancyGrid
from flatland.worldgen import maze_plan, office_plan, warehouse_plan
from flatland.worldgen.new_files import expand, grey_image, write_new
from flatland.worldgen.raster import FREE, FURNITURE, Raster
from flatland.worldgen.reach import Reach

DEFAULT_SIZE: Final = (60.0, 25.0)  # m
DEFAULT_RESOLUTION: Final = 0.05  # m
DEFAULT_RADIUS: Final = 0.3  # m

_MAX_SIDE: Final = 500.0  # m
_MAX_CELLS: Final = 40_000_000
_RESOLUTIONS: Final = (0.02, 0.1)  # m
_RADII: Final = (0.1, 0.45)  # m
_NARROWEST_GAP: Final = 0.3  # m; narrower gaps between furniture are filled
_ROOM_AT_START: Final = 0.6  # m; free radius around the robot of the world file
_ROBOT: Final = "robot.model.yaml"
_MAX_SEED: Final = 2**63 - 1
# Grey values of the map image; map_server takes the darker two as occupied.
_GREY: Final = np.array([255, 0, 64], np.uint8)


@dataclass(frozen=True, slots=True)
class _Generator:
    """How worlds of one kind are generated.

    Attributes:
        number: Part of the seed of its random numbers.
        min_size: Least length of the longer and the shorter side [m].
        draw: Draws the floor plan.
    """

    number: int
    min_size: tuple[float, float]
    draw: Callable[[Raster, Reach, float, np.random.Generator], None]


_GENERATORS: Final = {
    "office": _Generator(1, office_plan.MIN_SIZE, office_plan.draw_office),
    "maze": _Generator(2, maze_plan.MIN_SIZE, maze_plan.draw_maze),
    "warehouse": _Generator(3, warehouse_plan.MIN_SIZE, warehouse_plan.draw_warehouse),
}

KINDS: Final = tuple(_GENERATORS)
"""The kinds of random worlds."""


@dataclass(frozen=True, eq=False)
class RandomWorld:
    """A random world.

    Attributes:
        kind: `office`, `maze` or `warehouse`.
        seed: Seed of its random numbers.
        radius: Radius of the disc that reaches all free places [m].
        grid: The map, with the origin (0, 0, 0) at its lower left corner.
        furniture: Which cells are furniture, shelves or goods instead of walls, shape (rows,
            columns).
        start: Pose of the robot in the world file [m, m, rad].
    """

    kind: str
    seed: int
    radius: float
    grid: OccupancyGrid
    furniture: BoolArray
    start: Pose

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        rows, columns = self.grid.cells.shape
        return (columns * self.grid.resolution, rows * self.grid.resolution)

    def files(
        self, name: str = "", robot: str | os.PathLike[str] | None = None
    ) -> dict[str, bytes]:
        """Returns the contents of all files by name: world, map, map image and robot.

        Args:
            name: Name of the world, for comments; the kind by default.
            robot: Model file of the robot, to which the world file refers by its absolute path;
                None for a robot of its own.
        """
        values = {
            "name": name or self.kind,
            "kind": self.kind,
            "seed": str(self.seed),
            "size": "x".join(f"{side:g}" for side in self.size),
            "radius": f"{self.radius:g}",
            "resolution": f"{self.grid.resolution:g}",
            "x": f"{self.start[0]:.3f}",
            "y": f"{self.start[1]:.3f}",
            "robot": _ROBOT if robot is None else json.dumps(str(Path(robot).resolve())),
        }
        templates = importlib.resources.files("flatland.worldgen") / "templates"
        files = expand(templates / "world", values)
        if robot is None:
            files |= expand(templates / "robot", {"name": "robot"})
        kinds = np.where(self.grid.cells == FREE_CELL, 0, np.where(self.furniture, 2, 1))
        return files | {"map.pgm": grey_image(_GREY[kinds[::-1]])}

    def write(
        self,
        folder: str | os.PathLike[str],
        *,
        robot: str | os.PathLike[str] | None = None,
    ) -> Path:
        """Writes the files into a new folder: all of them, or none.

        Args:
            folder: The folder, which must not exist; the folder that contains it must.
            robot: Model file of the robot, see `files`; None for a robot of its own.

        Returns:
            The world file.

        Raises:
            WorldError: The folder exists, or the folder that contains it or the model file does
                not.
            OSError: A file cannot be written.
        """
        target = Path(checked_path("folder", folder))
        if target.exists() or target.is_symlink():
            raise WorldError(f"the folder {target} exists")
        if not target.parent.is_dir():
            raise WorldError(f"the folder {target.parent} does not exist")
        if robot is not None and not Path(checked_path("robot", robot)).is_file():
            raise WorldError(f"the model file {os.fspath(robot)} does not exist")
        write_new(target, self.files(target.name, robot))
        return target / "world.yaml"


def generate(
    kind: str,
    seed: int,
    size: tuple[float, float] = DEFAULT_SIZE,
    *,
    resolution: float = DEFAULT_RESOLUTION,
    radius: float = DEFAULT_RADIUS,
) -> RandomWorld:
    """Generates a random world; the same arguments return the same world.

    Args:
        kind: `office`, `maze` or `warehouse`.
        seed: Seed of the random numbers, at least 0.
        size: Width and height [m]; rounded to whole cells.
        resolution: Size of a cell of the map [m], 0.02 to 0.1.
        radius: Radius of the robot [m], 0.1 to 0.45: a disc of this radius reaches each place where
            it fits from every other one.

    Raises:
        ValueError: An argument is invalid.
    """
    check_choice("kind", kind, KINDS)
    generator = _GENERATORS[kind]
    seed = checked_count("seed", seed, 0, _MAX_SEED)
    resolution = checked_range("resolution", resolution, *_RESOLUTIONS, "m")
    radius = checked_range("radius", radius, *_RADII, "m")
    width, height = _checked_size(kind, size, generator.min_size, resolution)
    rng = np.random.default_rng((generator.number, seed))
    reach = Reach(radius, resolution)
    # All plans are drawn in landscape format.
    is_upright = height > width
    raster = Raster((height, width) if is_upright else (width, height), resolution)
    generator.draw(raster, reach, radius, rng)
    reach.fill_gaps(raster.cells, _NARROWEST_GAP)
    reach.seal(raster.cells)
    cells = np.ascontiguousarray(raster.cells.T) if is_upright else raster.cells
    grid = np.where(cells == FREE, FREE_CELL, OCCUPIED).astype(np.int8)
    return RandomWorld(
        kind,
        seed,
        radius,
        OccupancyGrid((0.0, 0.0, 0.0), resolution, grid),
        np.asarray(cells == FURNITURE),
        _start(cells, resolution, radius),
    )


def _start(cells: Any, resolution: float, radius: float) -> Pose:
    """Returns the place nearest to the centre with room for a robot, or just with enough room."""
    for free_radius in (max(_ROOM_AT_START, radius), radius):
        rows, columns = np.nonzero(Reach(free_radius, resolution).places(cells))
        if len(rows):
            break
    height, width = cells.shape
    nearest = np.argmin((columns + 0.5 - width / 2) ** 2 + (rows + 0.5 - height / 2) ** 2)
    x, y = (float(index[nearest] + 0.5) * resolution for index in (columns, rows))
    return (x, y, 0.0)


def _checked_size(
    kind: str, size: tuple[float, float], least: tuple[float, float], resolution: float
) -> tuple[float, float]:
    sides = plain_numbers(size, (2,))
    if sides is None:
        raise ValueError(f"size must be a width and a height in metres, got {shown(size)}")
    width, height = sides
    found = f"{width:g} x {height:g} m"
    if not (math.isfinite(width) and math.isfinite(height)):
        raise ValueError(f"size must be finite, got {found}")
    if max(width, height) < least[0] or min(width, height) < least[1]:
        raise ValueError(
            f"size of a random {kind} must be at least {least[0]:g} x {least[1]:g} m, got {found}"
        )
    if max(width, height) > _MAX_SIDE:
        raise ValueError(f"size must be at most {_MAX_SIDE:g} m along each side, got {found}")
    if width * height / resolution**2 > _MAX_CELLS:
        raise ValueError(
            f"the map must have at most {_MAX_CELLS} cells, got {found} with a resolution of "
            f"{resolution:g} m: choose a smaller size or larger cells"
        )
    return width, height
