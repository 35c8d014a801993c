"""Walls in front of randomly drawn edges of a layer, for variations of one map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flatland.errors import PluginError, WorldError
from flatland.geometry import IDENTITY, DoubleArray, Pose, compose, invert
from flatland.plugin_api.parameters import at_key, read_finite
from flatland.plugin_api.plugin import WorldPlugin
from flatland.suggestions import did_you_mean

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.layer import Layer

# A robot closer than this to the line through a wall is on neither side of it [m].
_LINE_TOLERANCE = 1e-5


class RandomWall(WorldPlugin):
    """Adds a parallel wall in front of randomly drawn edges of a layer."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and adds the walls."""
        layer_name = config.get("layer", "string")
        robot_name = config.get("robot_name", "string")
        count = config.get("num_of_walls", "int", 0)
        if count < 0:
            raise at_key(config, "num_of_walls").error(
                f'Invalid "num_of_walls", must not be negative, got {count}'
            )
        distance = read_finite(config, "wall_wall_dist", 1.0)
        if distance <= 0.0:
            raise at_key(config, "wall_wall_dist").error(
                f'Invalid "wall_wall_dist", must be greater than 0, got {distance}'
            )
        both_sides = config.get("double_wall", "bool", False)

        layer = self._find_layer(layer_name)
        robot = self._find_robot(robot_name)
        robot_in_layer = compose(invert(layer.body.pose), robot)
        edges = self._pick_edges(layer, count)
        walls = [np.empty((0, 4))]
        for edge in edges:
            side = 1.0 if both_sides else _side_of(edge, robot_in_layer, robot_name, layer_name)
            walls.append(_wall(edge, side * distance))
            if both_sides:
                walls.append(_wall(edge, -distance))
        if count:
            layer.add_edges(np.concatenate(walls).astype(np.float32))
            self.world.layer_changed(layer)

    def _find_layer(self, name: str) -> Layer:
        try:
            return self.world.layer(name)
        except WorldError as error:
            raise PluginError(error.message) from None

    def _find_robot(self, name: str) -> Pose:
        """Returns the initial pose of a model of the world file, world frame."""
        names = []
        for entry in self.world_config.optional_subnode("models", "list").items():
            names.append(entry.get("name", "string"))
            if names[-1] == name:
                pose: Pose = entry.get("pose", "pose", IDENTITY)
                return pose
        raise PluginError(
            f'robot "{name}" does not exist: no model of the world file has this name',
            hint=did_you_mean(name, names, "models of the world file"),
        )

    def _pick_edges(self, layer: Layer, count: int) -> DoubleArray:
        """Draws different edges (x1, y1, x2, y2), layer frame, shape (count, 4)."""
        edges: DoubleArray = layer.edges.astype(np.float64)
        if count > len(edges):
            raise PluginError(
                f'num_of_walls is {count}, but layer "{layer.name}" has only {len(edges)} edges'
            )
        picked: DoubleArray = edges[self.rng.choice(len(edges), size=count, replace=False)]
        return picked


def _normal(edge: DoubleArray) -> DoubleArray:
    along = edge[2:] - edge[:2]
    left: DoubleArray = np.array([-along[1], along[0]]) / np.hypot(along[0], along[1])
    return left


def _side_of(edge: DoubleArray, robot: Pose, robot_name: str, layer_name: str) -> float:
    """Returns the side of the line through an edge on which a robot is: 1 left, -1 right."""
    distance = float(_normal(edge) @ (np.array(robot[:2]) - edge[:2]))
    if abs(distance) < _LINE_TOLERANCE:
        x1, y1, x2, y2 = edge
        raise PluginError(
            f'robot "{robot_name}" is on the line through the wall from ({x1:g}, {y1:g}) to '
            f'({x2:g}, {y2:g}) of layer "{layer_name}": the side of the new wall is undefined'
        )
    return 1.0 if distance > 0.0 else -1.0


def _wall(edge: DoubleArray, offset: float) -> DoubleArray:
    """Returns a wall parallel to an edge, `offset` [m] to its left, and its two side walls."""
    # Unlike the reference: offset along the normal, so that the distance of slanted edges holds.
    shift = offset * _normal(edge)
    start, end = edge[:2], edge[2:]
    far_start, far_end = start + shift, end + shift
    return np.array(
        [[*far_start, *far_end], [*start, *far_start], [*end, *far_end]], dtype=np.float64
    )
