"""Markers of a model whose bodies move, compared with those of a new cache."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from visualization_msgs.msg import Marker, MarkerArray

import flatland
from flatland.node.markers.model_markers import ModelMarkers
from flatland.ros.adapters.writer import RosWriter

MODEL = """
bodies:
  - name: base
    footprints:
      - {type: circle, radius: 0.2, density: 1}
      - {type: polygon, points: [[0, 0], [1, 0], [0, 1]], density: 1}
  - {name: arm, pose: [0.5, 0.25, 1], footprints: [{type: circle, radius: 0.1, density: 1}]}
  - {name: frame, footprints: []}
joints:
  - {name: hinge, type: revolute, color: [1, 0, 0, 1],
     bodies: [{name: arm, anchor: [0.1, 0.2]}, {name: base, anchor: [0.5, -0.25]}]}
"""
STAMP = 3_000_000_007


@pytest.fixture
def model(tmp_path: Path) -> Any:
    (tmp_path / "arm.model.yaml").write_text(MODEL)
    path = tmp_path / "world.yaml"
    path.write_text(
        "properties: {}\nlayers: []\n"
        "models: [{name: arm, model: arm.model.yaml, pose: [1, 2, 3]}]\n"
    )
    with flatland.World.from_yaml(path, seed=1) as world:
        yield world.models[0]


def markers_of(message: Any) -> list[Marker]:
    received: list[Marker] = MarkerArray().deserialize(message.packed).markers
    return received


def by_genpy(message: Any) -> bytes:
    buffer = BytesIO()
    MarkerArray(markers_of(message)).serialize(buffer)
    return buffer.getvalue()


def test_poses_are_replaced_in_place(model: Any) -> None:
    cached = ModelMarkers(model, RosWriter)
    cached.message(0)
    for number in range(4):
        for body in model.bodies:
            body.set_velocity(number, -1.0, 2.0)
        model.bodies[1].set_pose(number, 2 * number, 0.3 * number)
        message = cached.message(STAMP)
        assert message.packed == ModelMarkers(model, RosWriter).message(STAMP).packed
        assert message.packed == by_genpy(message)


def test_markers_are_created_again_only_if_the_appearance_has_changed(model: Any) -> None:
    cached = ModelMarkers(model, RosWriter)
    first = cached.message(0)
    model.bodies[1].set_pose(1.0, 2.0, 0.3)
    assert cached.message(STAMP) is first
    model.bodies[1].color = (0.0, 1.0, 0.0, 1.0)
    assert cached.message(STAMP) is not first


def test_changed_footprints_and_colors_are_rebuilt(model: Any) -> None:
    cached = ModelMarkers(model, RosWriter)
    before = markers_of(cached.message(0))
    model.bodies[2].physics.create_edges([[9, 9, 9, 11]])
    model.bodies[2].color = model.bodies[0].color = (0.5, 0.5, 0.5, 0.5)
    after = markers_of(cached.message(0))
    assert len(after) == len(before) + 1
    assert {marker.color.a for marker in after[:2]} == {0.5}
    edge = after[3]
    assert (edge.type, edge.scale.x, edge.color.r) == (Marker.LINE_LIST, 0.03, 0.5)
    assert [(point.x, point.y, point.z) for point in edge.points] == [(9, 9, 0), (9, 11, 0)]
    assert (edge.pose.position.x, edge.pose.position.y) == model.bodies[2].pose[:2]
