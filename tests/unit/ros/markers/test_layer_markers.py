"""Markers of layers: height of walls, and vectorized construction."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest

pytest.importorskip("visualization_msgs", reason="ROS is not installed")

from visualization_msgs.msg import Marker, MarkerArray

from flatland.entities.layer import Layer
from flatland.node.markers.layer_markers import LayerMarkers
from flatland.node.markers.packed_markers import PackedMarkers
from flatland.physics import PhysicsWorld
from flatland.ros.adapters.writer import RosWriter


def make_layer(properties: dict[str, Any], edges: np.ndarray | None = None) -> Layer:
    if edges is None:
        edges = np.array([[0, 0, 2, 0]], np.float32)
    color = (0.1, 0.2, 0.3, 0.4)
    return Layer(
        PhysicsWorld(), ["walls"], 1, color, properties, origin=(1, 2, 0.5), edges=edges
    )  # fmt: skip


def markers_of(message: PackedMarkers) -> list[Marker]:
    received: list[Marker] = MarkerArray().deserialize(message.packed).markers
    return received


def heights(properties: dict[str, Any]) -> tuple[float, float]:
    (marker,) = markers_of(LayerMarkers(make_layer(properties), RosWriter).walls(0))
    z = [point.z for point in marker.points]
    return min(z), max(z)


@pytest.mark.parametrize(
    ("properties", "expected"),
    [
        ({}, (0, 1)),
        ({"debug": None}, (0, 1)),
        ({"debug": {}}, (0, 1)),
        ({"debug": {"min_z": -0.5, "max_z": 2}}, (-0.5, 2)),
        ({"debug": {"min_z": "0.25", "max_z": "3"}}, (0.25, 3)),
        ({"debug": {"max_z": 0.5}}, (0, 0.5)),
        ({"debug": {"max_z": 0.5, "other": [1]}, "more": 1}, (0, 0.5)),
    ],
)
def test_heights_of_walls(
    properties: dict[str, Any], expected: tuple[float, float], caplog: pytest.LogCaptureFixture
) -> None:
    assert heights(properties) == expected
    assert caplog.records == []


def test_walls_have_the_pose_and_colour_of_the_layer() -> None:
    (marker,) = markers_of(LayerMarkers(make_layer({}), RosWriter).walls(0))
    assert (marker.type, marker.action) == (Marker.TRIANGLE_LIST, Marker.ADD)
    assert marker.header.frame_id == "map"
    assert marker.frame_locked
    assert (marker.scale.x, marker.scale.y, marker.scale.z) == (1, 1, 1)
    color, position = marker.color, marker.pose.position
    assert (color.r, color.g, color.b, color.a) == pytest.approx((0.1, 0.2, 0.3, 0.4))
    assert (position.x, position.y, position.z) == (1, 2, 0)
    assert {(point.x, point.y) for point in marker.points} == {(0, 0), (2, 0)}


@pytest.mark.parametrize(
    ("debug", "reason"),
    [
        ("high", "debug must be a map with min_z and max_z, got 'high'"),
        ([0, 1], "debug must be a map"),
        ({"min_z": "low"}, "min_z must be a finite number, got 'low'"),
        ({"max_z": float("nan")}, "max_z must be a finite number, got nan"),
        ({"max_z": [1]}, "max_z must be a finite number"),
        ({"max_z": True}, "max_z must be a finite number"),
        ({"min_z": 1}, "min_z must be less than max_z, got 1 and 1"),
    ],
)
def test_invalid_heights_are_logged_and_ignored(
    debug: Any, reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        assert heights({"debug": debug}) == (0, 1)
    assert 'layer "walls"' in caplog.text
    assert reason in caplog.text


def test_layer_without_edges_has_no_marker() -> None:
    markers = LayerMarkers(make_layer({}, np.empty((0, 4), np.float32)), RosWriter)
    assert markers_of(markers.lines(0)) == []
    assert markers_of(markers.walls(0)) == []
