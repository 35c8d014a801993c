"""Where the robot of a scenario can be: between walls and models that never move."""

from __future__ import annotations

import functools
import math
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.config.inputs import Inputs
from flatland.config.reader import read_yaml
from flatland.errors import YamlError
from flatland.geometry import bounds_of, circle_points, transform_points
from flatland.runtime.free_space import FreeSpace, least_cell
from flatland.scenarios.stage import footprint

if TYPE_CHECKING:
    from flatland.entities.layer import Layer
    from flatland.entities.model import Model
    from flatland.geometry import BoolArray, Bounds, DoubleArray, Pose, Vector2
    from flatland.world import World

_CORNERS: Final = 64  # of a circle
_TOLERANCE: Final = 0.005  # of overlaps, as in `World.move_model` [m]


class Surroundings:
    """The walls and static models around a robot.

    The robot is regarded as the largest disc about its origin within its footprint: where the disc
    does not fit, the robot does not fit either.

    Attributes:
        radius: Radius of the disc [m].
        bounds: (x_min, y_min, x_max, y_max) of all obstacles [m]; None without obstacles.
    """

    def __init__(self, world: World, robot: Model, movable: Collection[str]) -> None:
        """Collects the obstacles.

        Args:
            world: The world.
            robot: The robot.
            movable: Names of the models that may be moved or deleted; they are no obstacles.
        """
        self._world, self._robot = world, robot
        _, self._bits = footprint(robot)
        self.radius = inner_radius(robot)
        self._layers = [one for one in world.layers if one.category_bits & self._bits]
        self._models = [
            model
            for model in world.models
            if model is not robot and model.name not in movable and _is_static(model)
        ]
        self._bodies: list[Any] = [layer.body for layer in self._layers]
        self._bodies += [body for model in self._models for body in model.bodies]
        edges = [layer.world_edges for layer in self._layers]
        edges += [edge for model in self._models for edge in _polygons(model, self._bits)]
        self._edges: DoubleArray = np.concatenate([np.empty((0, 4)), *edges])
        self.bounds: Bounds | None = bounds_of(self._edges.reshape(-1, 2))

    def solid_at(self, place: Vector2) -> str:
        """Returns what contains a place, such as `a wall of layer "walls"`; empty if nothing does.

        Only map images have walls with an interior.
        """
        for model in self._models:
            if any(_contains(polygon, place) for polygon in _polygons(model, self._bits)):
                return f'model "{model.name}"'
        for layer in self._layers:
            if self._is_image(layer) and _contains(layer.world_edges, place):
                return f'a wall of layer "{layer.name}"'
        return ""

    def is_outside(self, place: Vector2) -> bool:
        """Returns whether a place is outside of the rectangle around all obstacles."""
        if self.bounds is None:
            return False
        x_min, y_min, x_max, y_max = self.bounds
        return not (x_min <= place[0] <= x_max and y_min <= place[1] <= y_max)

    def overlapped_at(self, pose: Pose) -> str:
        """Returns which obstacle the robot would overlap at a pose; empty for none."""
        found = self._world.physics.overlapping_bodies(
            self._robot.bodies, pose, least_gap=-_TOLERANCE
        )
        for body in found:
            entity = self._world.body_of_id(body.id).entity
            if entity in self._layers:
                return f'layer "{entity.name}"'
            if entity in self._models:
                return f'model "{entity.name}"'
        return ""

    def is_open(self, regions: frozenset[int]) -> bool:
        """Returns whether regions extend beyond the rectangle, or are unknown."""
        return self._space is None or not regions or self._space.is_outside(regions)

    @property
    def has_images(self) -> bool:
        """Whether a layer is that of a map image."""
        return any(map(self._is_image, self._layers))

    @property
    def extent(self) -> str:
        """The rectangle around all obstacles, as a text."""
        x_min, y_min, x_max, y_max = self.bounds or (0.0, 0.0, 0.0, 0.0)
        return f"the walls from ({x_min:.4g}, {y_min:.4g}) to ({x_max:.4g}, {y_max:.4g})"

    def problem_at(self, place: Vector2, regions: frozenset[int]) -> str:
        """Returns why nothing can be at a place; empty if something may.

        Args:
            place: The place [m].
            regions: Other regions of the scenario.
        """
        solid = self.solid_at(place)
        if solid:
            return f"it is inside of {solid}"
        if self.is_outside(place) and not self.is_open(regions):
            return f"it is outside of {self.extent}"
        return ""

    def narrow(self, start: Vector2) -> str:
        """Returns the reason for a place that is not reached from a start."""
        return (
            f"no way from ({start[0]:.4g}, {start[1]:.4g}) is wide enough for a disc with the "
            f"radius {self.radius:.4g} m within the robot"
        )

    def regions(self, place: Vector2) -> frozenset[int]:
        """Returns the numbers of the connected regions of a place; empty if they are unknown."""
        return frozenset() if self._space is None else self._space.regions_at(*place)

    def reaches(self, regions: frozenset[int], place: Vector2, radius: float) -> bool:
        """Returns whether the disc may come within a radius of a place.

        Args:
            regions: The regions that the disc can reach.
            place: The place [m].
            radius: The radius [m].
        """
        if self._space is None or not regions:
            return True
        return self._space.distance_to(regions, *place) <= radius + self._cell

    @functools.cached_property
    def _cell(self) -> float:
        return 0.0 if self.bounds is None else least_cell(self.bounds)

    @functools.cached_property
    def _space(self) -> FreeSpace | None:
        """The free space of a disc that passes wherever one with the radius does."""
        if self.bounds is None:
            return None
        # The grid requires the distance hypot(r, cell / sqrt(2)) at centers, the nearest of which
        # is up to cell / sqrt(2) away from the middle of a passage.
        half = self._cell * math.sqrt(0.5)
        square = max(self.radius - half, 0.0) ** 2 - half**2
        radius = math.sqrt(max(square, (0.1 * self._cell) ** 2))
        return FreeSpace(self._edges, self.bounds, radius, 0.0, self._fits, cell=self._cell)

    def _fits(self, points: DoubleArray, disc: float) -> BoolArray:
        poses = np.column_stack((points, np.zeros(len(points))))
        return self._world.physics.free_discs(poses, disc, self._bits, only=self._bodies)

    def _is_image(self, layer: Layer) -> bool:
        """Returns whether the walls of a layer are those of an image, which bound areas."""
        if not layer.map_path:
            return layer.grid is not None
        try:
            return "image" in read_yaml(layer.map_path, Inputs(self._world.params, logs=False))
        except YamlError:
            return False


def inner_radius(robot: Model) -> float:
    """Returns the radius of the largest disc about the origin of a robot in one of its footprints.

    Only the first body is considered, since others may move. The radius is 0 if no footprint
    contains the origin [m].
    """
    largest = 0.0
    for fixture in robot.bodies[0].fixtures:
        if fixture.is_sensor or not fixture.mask_bits:
            continue
        if fixture.shape == "circle":
            radius = fixture.radius - math.hypot(*fixture.center)
        else:
            ends = np.asarray(fixture.vertices, float)
            along = np.roll(ends, -1, axis=0) - ends
            # Distances to the left of the edges, which are in counter-clockwise order.
            products = along[:, 1] * ends[:, 0] - along[:, 0] * ends[:, 1]
            radius = float((products / np.hypot(*along.T)).min())
        largest = max(largest, radius)
    return largest


def _is_static(model: Model) -> bool:
    return all(body.type == "static" for body in model.bodies)


def _polygons(model: Model, bits: int) -> Iterator[DoubleArray]:
    """Yields the outlines of the solid footprints of a model as edges, shape (n, 4)."""
    for body in model.bodies:
        for fixture in body.fixtures:
            if fixture.is_sensor or not fixture.category_bits & bits:
                continue
            if fixture.shape == "circle":
                points = circle_points(fixture.center, fixture.radius, _CORNERS)
            else:
                points = fixture.vertices
            corners = transform_points(body.pose, points)
            yield np.concatenate([corners, np.roll(corners, -1, axis=0)], axis=1)


def _contains(edges: DoubleArray, place: Vector2) -> bool:
    """Returns whether a place is within closed loops of edges: a ray crosses an odd number."""
    x, y = place
    x1, y1, x2, y2 = edges.T
    crossed = (y1 <= y) != (y2 <= y)
    x1, y1, x2, y2 = x1[crossed], y1[crossed], x2[crossed], y2[crossed]
    return bool(np.count_nonzero(x1 + (y - y1) * (x2 - x1) / (y2 - y1) > x) % 2)
