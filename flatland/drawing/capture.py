"""Copies everything that is drawn out of a world, in world coordinates."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flatland.entities.body import Body, Color
from flatland.errors import WorldError
from flatland.geometry import (
    Bounds,
    DoubleArray,
    Pose,
    bounds_of,
    circle_points,
    compose,
    transform_points,
)

if TYPE_CHECKING:
    from flatland.entities.joint import Joint
    from flatland.entities.layer import Layer
    from flatland.entities.model import Model
    from flatland.plugins.laser import Laser
    from flatland.world import World

_CIRCLE_POINTS = 64


@dataclass(frozen=True, slots=True)
class Outline:
    """Outline of a fixture.

    Attributes:
        points: Vertices, or the two end points of an edge; world frame [m], shape (n, 2).
        color: Colour of the body.
        is_sensor: Whether the fixture is a sensor.
    """

    points: DoubleArray
    color: Color
    is_sensor: bool


@dataclass(frozen=True, slots=True)
class LayerDrawing:
    """Edges of a layer.

    Attributes:
        edges: End points of each edge, world frame [m], shape (n, 2, 2).
        color: Colour of the layer.
    """

    edges: DoubleArray
    color: Color


@dataclass(frozen=True, slots=True)
class ModelDrawing:
    """Footprints of a model.

    Attributes:
        name: Name of the model.
        outlines: Fixtures of all visible bodies.
        center: Pose of the first body, moved to the centre of the bounds of its fixtures; None
            for a body that is hidden or has no fixtures.
        width: Shorter side of these bounds [m].
        color: Colour of the first body.
    """

    name: str
    outlines: list[Outline]
    center: Pose | None
    width: float
    color: Color

    def bounds(self) -> Bounds | None:
        """Returns the bounds of all outlines, None for a model without fixtures."""
        return _bounds_of_all([outline.points for outline in self.outlines])


@dataclass(frozen=True, slots=True)
class JointDrawing:
    """A joint.

    Attributes:
        points: Origin of body A, anchor A, anchor B, origin of body B; world frame [m],
            shape (4, 2).
        color: Colour of the joint.
    """

    points: DoubleArray
    color: Color


@dataclass(frozen=True, slots=True)
class ScanDrawing:
    """A laser scan.

    Attributes:
        area: Polygon covered by the beams, starting with the position of the sensor; world frame
            [m], shape (n + 1, 2).
        hits: End points of the beams that hit something; world frame [m], shape (k, 2).
    """

    area: DoubleArray
    hits: DoubleArray


@dataclass(frozen=True, slots=True)
class Scene:
    """Contents of an image of a world."""

    layers: list[LayerDrawing]
    models: list[ModelDrawing]
    joints: list[JointDrawing]
    scans: list[ScanDrawing]

    def bounds(self) -> Bounds | None:
        """Returns the bounds of all layers and models, None for an empty scene."""
        parts = [layer.edges.reshape(-1, 2) for layer in self.layers]
        parts += [outline.points for model in self.models for outline in model.outlines]
        return _bounds_of_all(parts)


def _bounds_of_all(parts: list[DoubleArray]) -> Bounds | None:
    return bounds_of(np.concatenate([*parts, np.empty((0, 2))]))


def capture_scene(world: World, layers: Iterable[str] | None, scans: bool) -> Scene:
    """Copies the contents of an image out of a world.

    Does not modify the world. Must not be called during a step.

    Args:
        world: The world.
        layers: Names of the layers to include, None for all.
        scans: Whether to include laser scans.

    Raises:
        WorldError: The world is closed, or a layer does not exist.
    """
    # Imported late: `import flatland` does not load the plugins.
    from flatland.plugins.laser import Laser

    if world.closed:
        raise WorldError("the world is closed")
    names = [layer.name for layer in world.layers] if layers is None else layers
    models = world.models
    return Scene(
        layers=[_draw_layer(layer) for layer in dict.fromkeys(map(world.layer, names))],
        models=[_draw_model(model) for model in models],
        joints=[
            _draw_joint(joint)
            for model in models
            for joint in model.joints
            if all(body.visible for body in joint.bodies)
        ],
        scans=[
            _draw_scan(plugin)
            for model in models
            for plugin in model.plugins
            if scans and isinstance(plugin, Laser)
        ],
    )


def _draw_layer(layer: Layer) -> LayerDrawing:
    return LayerDrawing(layer.world_edges.reshape(-1, 2, 2), layer.color)


def _local_outlines(body: Body) -> list[tuple[DoubleArray, bool]]:
    """Returns the vertices of each fixture in the body frame, and whether it is a sensor."""
    return [
        (
            circle_points(fixture.center, fixture.radius, _CIRCLE_POINTS)
            if fixture.shape == "circle"
            else np.asarray(fixture.vertices, np.float64),
            fixture.is_sensor,
        )
        for fixture in body.fixtures
    ]


def _draw_model(model: Model) -> ModelDrawing:
    outlines = []
    for body in model.bodies:
        if not body.visible:
            continue
        pose = body.pose
        outlines += [
            Outline(transform_points(pose, points), body.color, is_sensor)
            for points, is_sensor in _local_outlines(body)
        ]
    first = model.bodies[0]
    bounds = _bounds_of_all([points for points, _ in _local_outlines(first)])
    if bounds is None or not first.visible:
        return ModelDrawing(model.name, outlines, None, 0.0, first.color)
    x_min, y_min, x_max, y_max = bounds
    center = compose(first.pose, ((x_min + x_max) / 2, (y_min + y_max) / 2, 0.0))
    width = min(x_max - x_min, y_max - y_min)
    return ModelDrawing(model.name, outlines, center, width, first.color)


def _draw_joint(joint: Joint) -> JointDrawing:
    (pose_a, pose_b), (anchor_a, anchor_b) = (b.pose for b in joint.bodies), joint.anchors
    points = [
        pose_a[:2],
        transform_points(pose_a, anchor_a),
        transform_points(pose_b, anchor_b),
        pose_b[:2],
    ]
    return JointDrawing(np.array(points), joint.color)


def _draw_scan(laser: Laser) -> ScanDrawing:
    pose, ranges = laser.last_scan or laser.cast_without_noise()
    # A beam without a hit reports NaN, infinity or the full range; one whose hit is too close
    # reports -inf.
    is_hit = np.isfinite(ranges) & (ranges != np.float32(laser.range))
    fractions = np.where(is_hit, ranges.astype(np.float64) / laser.range, 1.0)
    fractions[np.isneginf(ranges)] = 0.0
    ends = transform_points(pose, laser.beam_ends * fractions[:, np.newaxis])
    return ScanDrawing(np.concatenate([[pose[:2]], ends]), ends[is_hit])
