"""Plain values that describe the layers and models of a world; copied between two steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flatland.entities.body import Body, Color
from flatland.entities.joint import Joint
from flatland.entities.layer import Layer
from flatland.entities.model import Model
from flatland.geometry import (
    DoubleArray,
    FloatArray,
    Pose,
    Vector2,
    circle_points,
    compose,
    transform_points,
)
from flatland.physics import PhysicsFixture


@dataclass(frozen=True, slots=True, eq=False)
class ShapeDescription:
    """Shape of a fixture, in the frame of its body.

    Attributes:
        kind: `circle`, `polygon` or `edge`.
        points: Centre of a circle, vertices of a polygon or end points of an edge [m],
            shape (n, 2).
        radius: Radius of a circle [m], 0 for other shapes.
        is_sensor: Whether the fixture is a sensor.
        category_bits: Category bits of the layers of the fixture.
    """

    kind: str
    points: DoubleArray
    radius: float
    is_sensor: bool
    category_bits: int

    def outline(self, circle_count: int) -> DoubleArray:
        """Returns the vertices of the outline [m], shape (n, 2).

        Args:
            circle_count: Number of vertices of a circle.
        """
        if self.kind == "circle":
            return circle_points(self.points[0], self.radius, circle_count)
        return self.points

    def segments(self, circle_count: int = 32) -> DoubleArray:
        """Returns the start and the end of each line of the outline [m], shape (2 n, 2).

        Args:
            circle_count: Number of lines of a circle.
        """
        points = self.outline(circle_count)
        if self.kind == "edge":
            return points
        lines: DoubleArray = np.stack((points, np.roll(points, -1, axis=0)), axis=1)
        return lines.reshape(-1, 2)


@dataclass(frozen=True, slots=True, eq=False)
class BodyDescription:
    """A body of a model.

    Attributes:
        name: Name of the body.
        type: `static`, `kinematic` or `dynamic`.
        color: (r, g, b, a), each in [0, 1].
        visible: Whether front ends show the body.
        pose: Pose in the world frame at the time of the description [m, rad].
        shapes: Shapes of the fixtures, also of a hidden body.
    """

    name: str
    type: str
    color: Color
    visible: bool
    pose: Pose
    shapes: list[ShapeDescription]

    @property
    def visible_shapes(self) -> list[ShapeDescription]:
        """The shapes to show: none for a hidden body."""
        return self.shapes if self.visible else []


@dataclass(frozen=True, slots=True, eq=False)
class JointDescription:
    """A joint between two visible bodies of a model.

    Attributes:
        name: Name of the joint.
        color: (r, g, b, a), each in [0, 1].
        bodies: Indices of body A and body B in the model.
        anchors: Anchor of each body in the frame of the body [m].
    """

    name: str
    color: Color
    bodies: tuple[int, int]
    anchors: tuple[Vector2, Vector2]

    def points(self, pose_a: Pose, pose_b: Pose) -> tuple[Vector2, Vector2, Vector2, Vector2]:
        """Returns the origin and the anchor of body A, and those of body B, in the world frame [m].

        Args:
            pose_a: Pose of body A in the world frame.
            pose_b: Pose of body B in the world frame.
        """
        anchor_a, anchor_b = self.anchors
        x_a, y_a, _ = compose(pose_a, (*anchor_a, 0.0))
        x_b, y_b, _ = compose(pose_b, (*anchor_b, 0.0))
        return pose_a[:2], (x_a, y_a), pose_b[:2], (x_b, y_b)


@dataclass(frozen=True, slots=True, eq=False)
class ModelDescription:
    """A model.

    Attributes:
        name: Name of the model.
        bodies: All bodies, in their order.
        joints: Joints whose bodies are both visible.
    """

    name: str
    bodies: list[BodyDescription]
    joints: list[JointDescription]


@dataclass(frozen=True, slots=True, eq=False)
class LayerDescription:
    """A layer.

    Attributes:
        name: First name of the layer.
        color: (r, g, b, a), each in [0, 1].
        pose: Pose of the layer in the world frame [m, rad].
        edges: (x1, y1, x2, y2) in the frame of the layer [m], shape (n, 4).
    """

    name: str
    color: Color
    pose: Pose
    edges: FloatArray

    def world_edges(self) -> DoubleArray:
        """Returns the edges (x1, y1, x2, y2) in the world frame [m], shape (n, 4)."""
        points = self.edges.astype(np.float64).reshape(-1, 2)
        return transform_points(self.pose, points).reshape(-1, 4)


def describe_layer(layer: Layer) -> LayerDescription:
    """Describes a layer."""
    return LayerDescription(layer.name, layer.color, layer.body.pose, layer.edges)


def describe_model(model: Model) -> ModelDescription:
    """Describes the bodies and joints of a model."""
    bodies = model.bodies
    return ModelDescription(
        name=model.name,
        bodies=[describe_body(body) for body in bodies],
        joints=[
            _describe_joint(joint, bodies)
            for joint in model.joints
            if all(body.visible for body in joint.bodies)
        ],
    )


def describe_body(body: Body) -> BodyDescription:
    """Describes a body and its shapes."""
    shapes = [_describe_shape(fixture) for fixture in body.fixtures]
    return BodyDescription(body.name, body.type, body.color, body.visible, body.pose, shapes)


def appearance_key(model: Model) -> object:
    """Returns a value that differs if the description of a model has changed.

    Poses, and the layers of fixtures, have no influence on the value.
    """
    return [(body.id, body.color, body.visible, body.fixture_ids) for body in model.bodies]


def _describe_shape(fixture: PhysicsFixture) -> ShapeDescription:
    kind = fixture.shape
    if kind == "circle":
        points, radius = np.array([fixture.center]), fixture.radius
    else:
        points, radius = fixture.vertices, 0.0
    return ShapeDescription(kind, points, radius, fixture.is_sensor, fixture.category_bits)


def _describe_joint(joint: Joint, bodies: list[Body]) -> JointDescription:
    body_a, body_b = joint.bodies
    (x_a, y_a), (x_b, y_b) = joint.anchors.tolist()
    indices = (bodies.index(body_a), bodies.index(body_b))
    return JointDescription(joint.name, joint.color, indices, ((x_a, y_a), (x_b, y_b)))
