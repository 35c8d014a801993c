"""Occupancy grids of layers, with the values of `map_server`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from flatland.config.hints import choice
from flatland.config.reader import YamlReader
from flatland.errors import WorldError
from flatland.geometry import DoubleArray
from flatland.maps.grey_image import read_grey_image
from flatland.maps.unreadable_image import why_unreadable
from flatland.values import GridCells, OccupancyGrid

if TYPE_CHECKING:
    from flatland.config.inputs import Params
    from flatland.entities.layer import Layer

FREE: Final = 0
OCCUPIED: Final = 100
UNKNOWN: Final = -1
DEFAULT_FREE_THRESH: Final = 0.196  # the default of map_server
MAX_CELLS: Final = 2**28  # of a grid of line segments; 256 MiB
_MODES: Final = ("trinary", "scale", "raw")


class ImageGrid:
    """The grid of a map image; the image is read by each call of `load`."""

    def __init__(self, reader: YamlReader) -> None:
        """Reads the map file without its image.

        Unlike the walls of the layer, the grid depends on `free_thresh`, `negate` and `mode`.

        Args:
            reader: Reader of the map file.

        Raises:
            YamlError: A value is invalid.
        """
        self._image = reader.subnode("image")
        self._path = reader.resolve_path(reader.get("image", "string"))
        self._resolution = reader.get("resolution", "float", finite=True)
        self._origin = reader.get("origin", "pose", finite=True)
        self._occupied_thresh = reader.get("occupied_thresh", "float", finite=True)
        self._free_thresh = reader.get("free_thresh", "float", DEFAULT_FREE_THRESH, finite=True)
        self._negate = _read_flag(reader, "negate")
        self._mode: str = reader.get("mode", "string", "trinary")
        if self._mode not in _MODES:
            error = reader.invalid("mode", f"must be one of: {', '.join(_MODES)}, got {self._mode}")
            error.hint = choice(self._mode, _MODES)
            reader.report(error)

    def load(self) -> OccupancyGrid:
        """Reads the image.

        Raises:
            YamlError: The image cannot be read.
        """
        try:
            image = read_grey_image(self._path)
        except OSError as error:
            raise self._image.error(
                f'Failed to load "{self._path}"', why_unreadable(self._path, error)
            ) from error
        cells = self._values()[image[::-1]]
        return OccupancyGrid(self._origin, self._resolution, cells)

    def _values(self) -> GridCells:
        """Returns the occupancy of each grey value, shape (256,)."""
        grey = np.arange(256)
        if self._mode == "raw":
            return grey.astype(np.uint8).view(np.int8)
        occupancy = (grey if self._negate else 255 - grey) / 255.0
        occupied, free = self._occupied_thresh, self._free_thresh
        values = np.full(256, UNKNOWN, np.int8)
        if self._mode == "scale" and free < occupied:
            between = (occupancy >= free) & (occupancy <= occupied)
            values[between] = 1 + 98 * (occupancy[between] - free) / (occupied - free)
        values[occupancy < free] = FREE
        values[occupancy > occupied] = OCCUPIED
        return values


class EdgeGrid:
    """The grid of the edges of a layer: each cell that contains a part of an edge is occupied."""

    def __init__(self, layer_name: str, edges: DoubleArray, resolution: float) -> None:
        """Checks the size of the grid.

        Args:
            layer_name: Name of the layer, for errors.
            edges: Edges (x1, y1, x2, y2) in the world frame [m], shape (n, 4).
            resolution: Size of a cell [m], positive.

        Raises:
            WorldError: There are no edges, or the grid would have more than `MAX_CELLS` cells.
        """
        if not len(edges):
            raise WorldError(f'layer "{layer_name}" has no walls and therefore no map')
        self._edges = edges
        self._resolution = resolution
        points = edges.reshape(-1, 2) / resolution
        self._low = np.floor(points.min(axis=0))
        width, height = np.floor(points.max(axis=0)) - self._low + 1
        if width * height > MAX_CELLS:
            raise WorldError(
                f'the map of layer "{layer_name}" would have {width:.0f} x {height:.0f} cells of '
                f"{resolution:g} m, more than {MAX_CELLS}; use a larger resolution"
            )
        self._shape = int(height), int(width)

    def load(self) -> OccupancyGrid:
        """Draws the edges."""
        cells = np.full(self._shape, FREE, np.int8)
        columns, rows = _cells_of_edges(self._edges / self._resolution - np.tile(self._low, 2))
        # Rounding may put a point at the border of the grid just outside the grid.
        height, width = self._shape
        cells[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)] = OCCUPIED
        x, y = (float(low) * self._resolution for low in self._low)
        return OccupancyGrid((x, y, 0.0), self._resolution, cells)


class GivenGrid:
    """The grid from which a layer was created."""

    def __init__(self, grid: OccupancyGrid) -> None:
        """Stores the grid."""
        self._grid = grid

    def load(self) -> OccupancyGrid:
        """Returns the grid."""
        return self._grid


GridSource = ImageGrid | EdgeGrid | GivenGrid
"""Loads the occupancy grid of a layer."""


def layer_grid(layer: Layer, params: Params, resolution: float) -> GridSource:
    """Returns the source of the occupancy grid of a layer.

    Walls that plugins added to the map of a layer are not part of the grid.

    Args:
        layer: The layer.
        params: Source of the values of `param()` in the map file.
        resolution: Size of a cell [m], positive; only for a layer that has no image.

    Raises:
        YamlError: The map file is invalid.
        WorldError: The layer has no walls, or too large a grid.
    """
    edges = layer.world_edges
    if layer.grid is not None:
        return GivenGrid(layer.grid)
    if layer.map_path:
        location = f'layer "{layer.name}"'
        reader = YamlReader.from_file(layer.map_path, params).with_location(location)
        if reader.get("type", "string", None) != "line_segments":
            return ImageGrid(reader)
        edges = edges[: layer.exact_edge_count]
    return EdgeGrid(layer.name, edges, resolution)


def _read_flag(reader: YamlReader, key: str) -> bool:
    """Reads 0 or 1, as map_server does, or a bool."""
    text = reader.get(key, "string", "0")
    if text in ("0", "1"):
        return text == "1"
    return reader.get(key, "bool", False)


def _cells_of_edges(edges: DoubleArray) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Returns the columns and rows of all cells that edges pass through, possibly repeated.

    Each edge is split where it crosses a border between cells; the centre of a part is inside the
    cell of the part. A point on a border belongs to the cell on its right or above it.

    Args:
        edges: Edges (x1, y1, x2, y2) [cells], shape (n, 4).
    """
    starts, ends = edges[:, :2], edges[:, 2:]
    every = np.arange(len(edges))
    indices, fractions = [every, every], [np.zeros(len(edges)), np.ones(len(edges))]
    for axis in (0, 1):
        index, fraction = _crossings(starts[:, axis], ends[:, axis])
        indices.append(index)
        fractions.append(fraction)
    index, fraction = np.concatenate(indices), np.concatenate(fractions)
    order = np.lexsort((fraction, index))
    index, fraction = index[order], fraction[order]
    is_part = index[1:] == index[:-1]
    middle = ((fraction[1:] + fraction[:-1]) / 2)[is_part, np.newaxis]
    edge = index[1:][is_part]
    centres = starts[edge] + middle * (ends[edge] - starts[edge])
    cells = np.floor(np.concatenate([centres, starts, ends])).astype(np.intp)
    return cells[:, 0], cells[:, 1]


def _crossings(start: DoubleArray, end: DoubleArray) -> tuple[npt.NDArray[np.intp], DoubleArray]:
    """Returns where intervals cross integers.

    Args:
        start: Start of each interval, shape (n,).
        end: End of each interval, shape (n,).

    Returns:
        For each crossing, the number of the interval and the fraction of its length.
    """
    first = np.floor(np.minimum(start, end)) + 1
    last = np.ceil(np.maximum(start, end)) - 1
    counts = np.maximum(last - first + 1, 0).astype(np.intp)
    index = np.repeat(np.arange(len(start)), counts)
    number = np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts, counts)
    fraction = (first[index] + number - start[index]) / (end - start)[index]
    return index, fraction
