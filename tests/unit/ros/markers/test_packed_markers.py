"""Serialized markers: equality with the serialization of ROS."""

from __future__ import annotations

import math
from io import BytesIO

import numpy as np
import pytest

pytest.importorskip("visualization_msgs", reason="ROS is not installed")

from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from flatland.node.markers.packed_markers import PackedMarkers, join
from flatland.ros.adapters.writer import RosWriter

POINTS = np.array([[1.5, -2.5, 3.5], [0.1, 0.2, 0.3]])
COLOR = (0.25, 0.5, 0.75, 1.0)


def packed() -> PackedMarkers:
    markers = PackedMarkers(RosWriter, "Größe")
    markers.add(Marker.LINE_LIST, POINTS, scale=(0.03, 0, 0), color=COLOR)
    markers.add(Marker.CUBE_LIST, POINTS[:1], scale=(1, 2, 3), color=COLOR, frame_locked=True)
    markers.add_deletion()
    markers.add_deletion_of_all()
    markers.set_stamp(12_345_678_901)
    markers.set_poses([1], (4.0, 5.0, math.pi / 2))
    return markers


def expected() -> MarkerArray:
    markers = [
        Marker(type=Marker.LINE_LIST, scale=Vector3(0.03, 0, 0), points=as_messages(POINTS)),
        Marker(type=Marker.CUBE_LIST, scale=Vector3(1, 2, 3), points=as_messages(POINTS[:1])),
        Marker(action=Marker.DELETE),
        Marker(action=Marker.DELETEALL),
    ]
    for number, marker in enumerate(markers):
        marker.header.frame_id = "map"
        marker.header.stamp.secs, marker.header.stamp.nsecs = 12, 345_678_901
        marker.ns, marker.id = "Größe", number
        marker.pose.orientation.w = 1.0
        if number < 2:
            marker.color = ColorRGBA(*COLOR)
    pose = markers[1].pose
    pose.position.x, pose.position.y = 4.0, 5.0
    pose.orientation.z = pose.orientation.w = math.sqrt(0.5)
    markers[1].frame_locked = True
    return MarkerArray(markers)


def as_messages(points: np.ndarray) -> list[Point]:
    return [Point(*point) for point in points.tolist()]


def markers_of(message: PackedMarkers) -> list[Marker]:
    received: list[Marker] = MarkerArray().deserialize(message.packed).markers
    return received


def data(message: MarkerArray) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def test_serialization_equals_that_of_the_message() -> None:
    message = expected()
    message.markers[1].pose.orientation.z = math.sin(math.pi / 4)
    message.markers[1].pose.orientation.w = math.cos(math.pi / 4)
    assert packed().packed == data(message)


def test_markers_added_later_get_the_same_stamp() -> None:
    markers = packed()
    markers.set_stamp(5)
    number = markers.add_deletion()
    markers.set_stamp(5)
    assert markers_of(markers)[number].header.stamp.nsecs == 5


def test_joined_markers_are_those_of_all_parts() -> None:
    joined = join([packed(), PackedMarkers(RosWriter, "empty"), packed()], RosWriter)
    assert joined == data(MarkerArray(markers_of(packed()) * 2))


def test_points_are_replaced_in_place() -> None:
    markers = packed()
    markers.set_points(0, (POINTS * 2).tobytes())
    first, second, *_ = markers_of(markers)
    assert first.points == as_messages(POINTS * 2)
    assert second.points == as_messages(POINTS[:1])


def test_different_number_of_points_raises() -> None:
    with pytest.raises(ValueError, match="marker 0 has 2 points, got 24 bytes"):
        packed().set_points(0, POINTS[:1].tobytes())


def test_points_of_invalid_shape_raise() -> None:
    with pytest.raises(ValueError, match=r"points must have shape \(n, 3\), got \(2, 2\)"):
        packed().add(Marker.LINE_LIST, POINTS[:, :2], scale=(1, 1, 1), color=COLOR)


def test_empty_array() -> None:
    assert PackedMarkers(RosWriter).packed == data(MarkerArray())


def test_a_deletion_of_all_markers_has_a_stamp() -> None:
    (marker,) = markers_of(PackedMarkers.deletion_of_all(RosWriter, 1_500_000_000))
    assert marker.action == Marker.DELETEALL
    assert (marker.header.stamp.secs, marker.header.stamp.nsecs) == (1, 500_000_000)
