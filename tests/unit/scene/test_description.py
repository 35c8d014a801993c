"""Descriptions of shapes and models as plain values."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.scene.description import ShapeDescription, appearance_key, describe_model

MODEL = """
bodies:
- {name: base, color: [0, 0, 1, 1], footprints: [{type: circle, radius: 0.5, density: 1}]}
- {name: arm, pose: [1, 0, 0], footprints: [
   {type: polygon, points: [[0, 0], [2, 0], [2, 1]], density: 1, sensor: true}]}
joints:
- {type: weld, name: j, bodies: [{name: arm, anchor: [0.5, 0]}, {name: base, anchor: [0, 0.25]}]}
"""


def shape(kind: str, points: Any, radius: float = 0.0) -> ShapeDescription:
    return ShapeDescription(kind, np.array(points, float), radius, False, 1)


@pytest.fixture
def world(files: Any) -> flatland.World:
    files.write("robot.model.yaml", MODEL)
    return files.load(  # type: ignore[no-any-return]
        "{properties: {}, layers: [], models: [{name: r, model: robot.model.yaml}]}"
    )


class TestSegments:
    def test_a_polygon_is_closed(self):
        lines = shape("polygon", [(0, 0), (1, 0), (0, 1)]).segments().reshape(-1, 2, 2)
        assert lines.tolist() == [[[0, 0], [1, 0]], [[1, 0], [0, 1]], [[0, 1], [0, 0]]]

    def test_an_edge_is_one_line(self):
        assert shape("edge", [(0, 0), (1, 0)]).segments().tolist() == [[0, 0], [1, 0]]

    def test_a_circle_is_a_closed_polygon(self):
        lines = shape("circle", [(1, 2)], 0.5).segments(16).reshape(-1, 2, 2)
        assert len(lines) == 16
        np.testing.assert_allclose(lines[:, 1], np.roll(lines[:, 0], -1, axis=0))
        assert np.hypot(*(lines[:, 0] - (1, 2)).T) == pytest.approx(0.5)


def test_a_model_consists_of_its_bodies_shapes_and_joints(world):
    model = describe_model(world.models[0])
    base, arm = model.bodies
    assert (model.name, base.name, arm.name) == ("r", "base", "arm")
    assert (base.color, base.type, arm.pose) == ((0, 0, 1, 1), "dynamic", (1, 0, 0))
    (circle,), (polygon,) = base.shapes, arm.shapes
    assert (circle.kind, circle.points.tolist(), circle.radius) == ("circle", [[0, 0]], 0.5)
    assert (polygon.kind, polygon.is_sensor, len(polygon.points)) == ("polygon", True, 3)
    (joint,) = model.joints
    assert (joint.bodies, joint.anchors) == ((1, 0), ((0.5, 0), (0, 0.25)))


def test_shapes_and_joints_of_hidden_bodies_are_not_shown(world):
    world.set_appearance("r", "arm", visible=False)
    model = describe_model(world.models[0])
    assert [len(body.shapes) for body in model.bodies] == [1, 1]
    assert [len(body.visible_shapes) for body in model.bodies] == [1, 0]
    assert model.joints == []


def test_the_key_of_the_appearance_differs_after_a_change_but_not_after_a_move(world):
    model = world.models[0]
    before = appearance_key(model)
    world.move_model("r", (1, 2, 3))
    assert appearance_key(model) == before
    keys = [before]
    world.set_appearance("r", "base", color=(1, 0, 0))
    keys.append(appearance_key(model))
    world.set_appearance("r", "base", visible=False)
    keys.append(appearance_key(model))
    model.bodies[0].create_circle((0.0, 0.0), 0.3, density=1.0)
    keys.append(appearance_key(model))
    assert all(one != other for one, other in itertools.pairwise(keys))
