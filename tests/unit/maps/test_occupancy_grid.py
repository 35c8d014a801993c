"""Occupancy grids of layers: values of map images, and agreement with the walls."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

import flatland
from flatland.errors import FlatlandError, WorldError, YamlError
from flatland.geometry import invert, transform_points
from flatland.maps import occupancy_grid
from flatland.maps.occupancy_grid import EdgeGrid, OccupancyGrid, layer_grid

RESOLUTION = 0.05
GREYS = [[0, 88, 89], [90, 166, 204], [205, 206, 255]]  # around the thresholds of map_server


class Maps:
    """Writes map files and returns the grid of their layer."""

    def __init__(self, files: Any) -> None:
        self.files = files

    def image(self, greys: list[list[int]] = GREYS, **keys: object) -> Any:
        cv2.imwrite(str(self.files.folder / "map.png"), np.array(greys, np.uint8))
        values = {
            "image": "map.png",
            "resolution": 0.5,
            "origin": "[1.5, -2, 0.3]",
            "occupied_thresh": 0.65,
            **keys,
        }
        self.files.write("map.yaml", "\n".join(f"{k}: {v}" for k, v in values.items()))
        return self.source("{name: walls, map: map.yaml}")

    def lines(self, lines: str, origin: str = "[0, 0, 0]", resolution: float = RESOLUTION) -> Any:
        self.files.write("lines.dat", lines)
        self.files.write(
            "map.yaml", f"{{type: line_segments, data: lines.dat, scale: 1, origin: {origin}}}"
        )
        return self.source("{name: walls, map: map.yaml}", resolution)

    def source(self, layer: str, resolution: float = RESOLUTION) -> Any:
        (self.layer,) = self.files.load(f"{{properties: {{}}, layers: [{layer}]}}").layers
        return layer_grid(self.layer, None, resolution)


@pytest.fixture
def maps(files: Any) -> Maps:
    return Maps(files)


def occupied_points(grid: OccupancyGrid, offset: float) -> npt.NDArray[np.float64]:
    """Returns a point of each occupied cell [cells], shape (n, 2)."""
    rows, columns = np.nonzero(grid.cells == 100)
    return np.stack([columns, rows], axis=1) + offset


def cells_of(grid: OccupancyGrid, p_world: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns points of the world in units of cells, relative to the corner of the grid."""
    return transform_points(invert(grid.origin), p_world) / grid.resolution


def distance_from_occupied(
    grid: OccupancyGrid, p_world: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Returns the distance of points from the nearest occupied cell [cells], at most 2."""
    points = cells_of(grid, p_world)
    padded = np.pad(grid.cells == 100, 3)
    corner = np.floor(points).astype(int)
    best = np.full(len(points), 2.0)
    for dx in range(-2, 3):
        for dy in range(-2, 3):
            x, y = corner[:, 0] + dx, corner[:, 1] + dy
            gap_x = np.maximum(np.maximum(x - points[:, 0], points[:, 0] - x - 1), 0)
            gap_y = np.maximum(np.maximum(y - points[:, 1], points[:, 1] - y - 1), 0)
            distance = np.where(padded[y + 3, x + 3], np.hypot(gap_x, gap_y), 2.0)
            best = np.minimum(best, distance)
    return best


def points_on(edges: npt.NDArray[np.float64], spacing: float) -> npt.NDArray[np.float64]:
    """Returns points along edges, shape (n, 2)."""
    parts = []
    for x1, y1, x2, y2 in edges:
        count = math.ceil(math.hypot(x2 - x1, y2 - y1) / spacing) + 1
        parts.append(np.linspace((x1, y1), (x2, y2), count))
    return np.concatenate(parts)


class TestImages:
    # Occupied if (255 - grey) / 255 > 0.65, free if it is < 0.196; the bottom row first.
    @pytest.mark.parametrize(
        ("greys", "keys", "cells"),
        [
            (GREYS, {}, [[-1, 0, 0], [-1, -1, -1], [100, 100, 100]]),
            (GREYS, {"negate": "0"}, [[-1, 0, 0], [-1, -1, -1], [100, 100, 100]]),
            (GREYS, {"free_thresh": 0.25}, [[0, 0, 0], [-1, -1, 0], [100, 100, 100]]),
            (GREYS, {"occupied_thresh": 0.651}, [[-1, 0, 0], [-1, -1, -1], [100, 100, -1]]),
            ([[0, 49, 50], [165, 166, 255]], {"negate": "1"}, [[-1, 100, 100], [0, 0, -1]]),
            ([[49, 50]], {"negate": "true"}, [[0, -1]]),
            ([[0, 100, 255]], {"mode": "raw"}, [[0, 100, -1]]),
        ],
    )
    def test_values_are_those_of_map_server(
        self, maps: Maps, greys: Any, keys: dict[str, object], cells: Any
    ) -> None:
        grid = maps.image(greys, **keys).load()
        assert grid.cells.dtype == np.int8
        assert grid.cells.tolist() == cells
        assert (grid.resolution, grid.origin) == (0.5, (1.5, -2.0, 0.3))

    def test_mode_scale(self, maps: Maps) -> None:
        greys = [[0, 89, 90, 147, 204, 205, 206]]
        grid = maps.image(greys, mode="scale").load()
        ratios = [(1 - grey / 255 - 0.196) / (0.65 - 0.196) for grey in (90, 147, 204, 205)]
        expected = [100, 100, *(int(1 + 98 * ratio) for ratio in ratios), 0]
        assert grid.cells.tolist() == [expected]

    def test_the_image_is_read_by_load(self, maps: Maps) -> None:
        source = maps.image()
        Path(maps.files.folder / "map.png").unlink()
        with pytest.raises(YamlError, match=r'Failed to load ".*map\.png".*map\.yaml:1'):
            source.load()

    @pytest.mark.parametrize(
        ("key", "value", "message"),
        [
            ("mode", "grey", 'Invalid "mode", must be one of: trinary, scale, raw, got grey'),
            ("negate", "2", 'Error converting entry "negate" to bool'),
            ("free_thresh", "low", 'Error converting entry "free_thresh" to float'),
            ("free_thresh", ".nan", 'Invalid "free_thresh", must be finite'),
        ],
    )
    def test_invalid_values(self, maps: Maps, key: str, value: str, message: str) -> None:
        with pytest.raises(YamlError) as caught:
            maps.image(**{key: value})
        assert message in str(caught.value)
        assert '(in layer "walls"' in str(caught.value)
        assert "map.yaml:5" in str(caught.value)


class TestLineSegments:
    LINES = "0 0 3.3 1.7\n3.3 1.7 -1.2 2.5\n0.5 0.5 0.5 1.5\n2 2 2.01 2.01\n1 0.3 2 0.3\n"

    @pytest.mark.parametrize("origin", ["[0, 0, 0]", "[-7.3, 12.1, 0.7]"])
    def test_each_point_of_a_wall_is_in_an_occupied_cell(self, maps: Maps, origin: str) -> None:
        grid = maps.lines(self.LINES, origin).load()
        points = points_on(maps.layer.world_edges, 0.001)
        assert len(points) > 9000
        assert distance_from_occupied(grid, points).max() < 1e-3
        assert grid.origin[2] == 0.0

    def test_each_occupied_cell_contains_a_part_of_a_wall(self, maps: Maps) -> None:
        grid = maps.lines(self.LINES).load()
        points = np.floor(cells_of(grid, points_on(maps.layer.world_edges, 0.0001)))
        covered = {tuple(point) for point in points.astype(int).tolist()}
        cells = {tuple(point) for point in occupied_points(grid, 0).astype(int).tolist()}
        # Cells of which a wall crosses just a corner may have no point.
        assert len(cells) > 200
        assert len(cells - covered) <= 0.01 * len(cells)

    def test_other_cells_are_free(self, maps: Maps) -> None:
        grid = maps.lines("0 0 1 0\n1 0 1 1", resolution=0.25).load()
        assert grid.cells.tolist() == [
            [100, 100, 100, 100, 100],
            *[[0, 0, 0, 0, 100]] * 4,
        ]
        assert grid.origin == (0.0, 0.0, 0.0)

    def test_the_corner_is_a_multiple_of_the_resolution(self, maps: Maps) -> None:
        grid = maps.lines("-0.3 0.3 0.6 0.3", resolution=0.25).load()
        assert grid.origin == (-0.5, 0.25, 0.0)
        assert grid.cells.tolist() == [[100, 100, 100, 100, 100]]

    def test_rounding_at_the_border_of_the_grid_is_harmless(self, maps: Maps) -> None:
        # The upper end rounds to the next cell when it is relative to the lower one.
        edges = np.array([[-1000.0, 0.0, np.nextafter(5.0, 0.0), 0.0]])
        grid = EdgeGrid("walls", edges, 1.0).load()
        assert grid.cells.shape == (1, 1005)
        assert grid.cells.all()

    def test_walls_of_plugins_are_not_part_of_the_map(self, maps: Maps) -> None:
        maps.lines("0 0 9 0\n9 0 9 9")
        maps.files.write("robot.model.yaml", "bodies: [{name: base, footprints: []}]")
        world = maps.files.load(
            """
            properties: {}
            layers: [{name: walls, map: map.yaml}]
            models: [{name: robot, model: robot.model.yaml, pose: [3, 4, 0]}]
            plugins:
              - {type: RandomWall, name: extra, layer: walls, num_of_walls: 2, robot_name: robot}
            """
        )
        layer = world.layer("walls")
        assert len(layer.edges) > 2
        grid = layer_grid(layer, None, 1.0).load()
        assert grid.cells.sum() == 100 * 19

    def test_a_layer_without_walls_is_an_error(self, maps: Maps) -> None:
        with pytest.raises(WorldError, match='layer "empty" has no walls and therefore no map'):
            maps.source("{name: empty}")

    def test_a_grid_that_is_too_large_is_an_error(self, maps: Maps) -> None:
        message = r"1000001 x 20001 cells of 0.05 m, more than 268435456; use a larger resolution"
        with pytest.raises(WorldError, match=message):
            maps.lines("0 0 50000 1000")

    def test_the_limit_of_cells_is_allowed(
        self, maps: Maps, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(occupancy_grid, "MAX_CELLS", 21)
        assert maps.lines("0 0 1 0").load().cells.shape == (1, 21)
        monkeypatch.setattr(occupancy_grid, "MAX_CELLS", 20)
        with pytest.raises(FlatlandError):
            maps.lines("0 0 1 0")


def test_the_grid_of_an_image_agrees_with_the_walls(checkout: Path) -> None:
    pose = (-3.0, -5.5, 0.3)
    with flatland.World.from_yaml(checkout / "worlds/office/world.yaml", seed=1) as loaded:
        walls = loaded.layer("walls")
        grid = layer_grid(walls, None, RESOLUTION).load()
        # A point of a wall is on an occupied cell or on its border; half a cell allows for the
        # rounding of edges to single precision.
        assert distance_from_occupied(grid, points_on(walls.world_edges, 0.02)).max() < 0.5
        angles = np.linspace(0, 2 * math.pi, 720, endpoint=False)
        ends = 100 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        fractions, _ = loaded.physics.cast_rays(
            pose, ends.astype(np.float32), loaded.collision_filter.category_bits(["walls"])
        )
        assert np.isfinite(fractions).all()
        hits = transform_points(pose, ends * fractions[:, np.newaxis])
        assert distance_from_occupied(grid, hits).max() < 1
        # The rays do not pass through occupied cells, apart from corners that they graze.
        middles = transform_points(pose, ends * fractions[:, np.newaxis] / 2)
        columns, rows = np.floor(cells_of(grid, middles)).astype(int).T
        assert (grid.cells[rows, columns] == 0).mean() > 0.99
