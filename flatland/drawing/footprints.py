"""Footprints of models in the world frame, as they are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from flatland.entities.body import Color
from flatland.geometry import Bounds, DoubleArray, Pose, bounds_of, compose, transform_points
from flatland.scene.description import ModelDescription
from flatland.scene.world_scene import Scene

_CIRCLE_POINTS: Final = 64


@dataclass(frozen=True, slots=True, eq=False)
class ShapeOutline:
    """Outline of a fixture.

    Attributes:
        points: Vertices, or the two end points of an edge; world frame [m], shape (n, 2).
        color: Colour of the body.
        is_sensor: Whether the fixture is a sensor.
    """

    points: DoubleArray
    color: Color
    is_sensor: bool


@dataclass(frozen=True, slots=True, eq=False)
class Footprints:
    """Footprints of a model.

    Attributes:
        name: Name of the model.
        outlines: Outlines of the visible fixtures.
        bounds: Bounds of all outlines, None for a model without visible fixtures.
        center: Pose of the first body, moved to the centre of the bounds of its fixtures; None
            for a body that is hidden or has no fixtures.
        width: Shorter side of these bounds [m].
        color: Colour of the first body.
    """

    name: str
    outlines: list[ShapeOutline]
    bounds: Bounds | None
    center: Pose | None
    width: float
    color: Color


def footprints_of(model: ModelDescription) -> Footprints:
    """Returns the footprints of a model."""
    outlines = [
        ShapeOutline(
            transform_points(body.pose, shape.outline(_CIRCLE_POINTS)), body.color, shape.is_sensor
        )
        for body in model.bodies
        for shape in body.visible_shapes
    ]
    first, center, width = model.bodies[0], None, 0.0
    bounds = _bounds_of_all([shape.outline(_CIRCLE_POINTS) for shape in first.visible_shapes])
    if bounds is not None:
        x_min, y_min, x_max, y_max = bounds
        center = compose(first.pose, ((x_min + x_max) / 2, (y_min + y_max) / 2, 0.0))
        width = min(x_max - x_min, y_max - y_min)
    total = _bounds_of_all([outline.points for outline in outlines])
    return Footprints(model.name, outlines, total, center, width, first.color)


def scene_bounds(scene: Scene) -> Bounds | None:
    """Returns the bounds of all layers and models, None for an empty scene."""
    parts = [layer.world_edges().reshape(-1, 2) for layer in scene.layers]
    for model in scene.models:
        parts += [outline.points for outline in footprints_of(model).outlines]
    return _bounds_of_all(parts)


def _bounds_of_all(parts: list[DoubleArray]) -> Bounds | None:
    return bounds_of(np.concatenate([*parts, np.empty((0, 2))]))
