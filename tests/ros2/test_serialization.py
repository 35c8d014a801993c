"""Serialized values: every field as rclpy reads it, with texts of any length before numbers."""

from __future__ import annotations

import array
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from visualization_msgs.msg import MarkerArray

import flatland
from flatland import values
from flatland.node import values as node_values
from flatland.node.adapters.marker import Marker
from flatland.node.markers.packed_markers import PackedMarkers, join
from flatland.ros2.adapters import find_adapter
from flatland.ros2.writer import CdrWriter

STAMP = 1_234_567_890_987_654_321  # more digits than a float can represent
TIME = [1_234_567_890, 987_654_321]
ROWS = np.array([[1.0, 2.0, 0.0], [4.0, 5.0, 0.0]])
SQUARE = np.arange(36.0).reshape(6, 6)
SMALL = np.arange(9.0).reshape(3, 3)
NO_ROTATION = [0.0, 0.0, 0.0, 1.0]
POINTS = np.arange(6.0).reshape(3, 2)
NONE = np.zeros((0, 2))


def leaves(value: Any) -> Iterator[Any]:
    """Returns all numbers and texts of a message, in the order of its definition."""
    if hasattr(value, "get_fields_and_field_types"):
        for name in value.get_fields_and_field_types():
            yield from leaves(getattr(value, name))
    elif isinstance(value, (list, tuple, array.array, np.ndarray)):
        for item in value:
            yield from leaves(item)
    else:
        yield value


def received(value: Any) -> list[Any]:
    adapter = find_adapter(type(value))
    assert adapter is not None
    assert adapter.serialize is not None
    return list(leaves(deserialize_message(adapter.serialize(value), adapter.message_type)))


def planar(rows: Any) -> list[float]:
    return [number for x, y, _ in rows for number in (x, y, 0.0, *NO_ROTATION)]


def twists(rows: Any) -> list[float]:
    return [number for x, y, w in rows for number in (x, y, 0.0, 0.0, 0.0, w)]


def cases(text: str) -> dict[str, tuple[Any, list[Any]]]:
    """Returns values with a text, and what their messages contain."""
    header = [*TIME, text]
    floats = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    ranges, no_ranges = np.arange(5, dtype=np.float32), np.zeros(0, np.float32)
    grid = flatland.OccupancyGrid((1.0, 2.0, 0.0), 0.5, np.arange(6, dtype=np.int8).reshape(2, 3))
    metadata = [*TIME, 0.5, 3, 2, 1.0, 2.0, 0.0, *NO_ROTATION]
    label = values.SemanticLabel(text, "b", (text, "cd"), "")
    collisions = (
        values.Collision(text, "a", "bc", text, np.zeros(0), NONE, POINTS),
        values.Collision("", text, "b", "c", np.arange(2.0), POINTS, NONE),
    )
    return {
        "scan": (
            values.LaserScan(STAMP, text, *floats, ranges, no_ranges),
            [*header, *floats, *range(5)],
        ),
        "odometry": (
            values.Odometry(STAMP, text, "ab", (1, 2, 0), (3, 4, 5), SQUARE, SQUARE),
            [*header, "ab", *planar([(1, 2, 0)]), *range(36), *twists([(3, 4, 5)]), *range(36)],
        ),
        "imu": (
            values.Imu(STAMP, text, 0.0, 3.0, (4.0, 5.0), SMALL, SMALL, SMALL),
            [*header, *NO_ROTATION, *range(9), 0, 0, 3.0, *range(9), 4.0, 5.0, 0, *range(9)],
        ),
        "range": (
            values.Range(STAMP, text, "infrared", *floats[:4]),
            [*header, 1, *floats[:4], 0.0],
        ),
        "fix": (
            values.NavSatFix(STAMP, text, 1.0, 2.0, 3.0),
            [*header, 0, 1, 1.0, 2.0, 3.0, *[0.0] * 9, 0],
        ),
        "joints": (
            values.JointState(STAMP, (text, "a"), (1.0, 2.0), (3.0, 4.0)),
            [*TIME, "", text, "a", 1.0, 2.0, 3.0, 4.0],
        ),
        "twist": (
            values.TwistWithCovariance(STAMP, text, (1, 2, 3), SQUARE),
            [*header, *twists([(1, 2, 3)]), *range(36)],
        ),
        "pose": (values.PoseStamped(STAMP, text, (1, 2, 0)), [*header, *planar([(1, 2, 0)])]),
        "people": (values.People(STAMP, text, ("a", "b"), ROWS), [*header, *planar(ROWS)]),
        "transforms": (
            node_values.Transforms(
                values.Transform(STAMP, text, name, 1.0, 2.0, 0.0) for name in ("a", text)
            ),
            [each for name in ("a", text) for each in (*header, name, *planar([(1, 2, 0)]))],
        ),
        "map": (
            node_values.PublishedMap(STAMP, grid, text),
            [*header, *metadata, *range(6)],
        ),
        "metadata": (node_values.MapMetadata(STAMP, grid), metadata),
        "states": (
            node_values.StampedModelStates(STAMP, text, ["a", text], ["", text], ROWS, ROWS),
            [*header, "a", text, "", text, *ROWS.ravel(), *twists(ROWS)],
        ),
        "collisions": (
            values.Collisions(STAMP, text, collisions),
            [*header, text, "a", "bc", text, *range(6), "", text, "b", "c", 0, 1, *range(6)],
        ),
        "semantic scan": (
            values.SemanticScan(
                STAMP, text, *floats[:5], ranges, np.arange(5, dtype=np.uint32), (label, label)
            ),
            [*header, *floats[:5], *range(5), *range(5), *[text, "b", text, "cd", ""] * 2],
        ),
        "debug topics": (node_values.DebugTopicNames(("a", text)), ["a", text]),
    }


@pytest.mark.parametrize("length", range(9))
@pytest.mark.parametrize("name", cases(""))
def test_messages(name: str, length: int) -> None:
    value, expected = cases("x" * length)[name]
    assert received(value) == expected


def test_diagnostics() -> None:
    status = node_values.Status("node: rate", node_values.Level.WARN, "slow", {"rate": "3"})
    found = received(node_values.Diagnostics([status]))
    assert found[2:] == ["", b"\1", "node: rate", "slow", "flatland", "rate", "3"]


@pytest.mark.parametrize("length", range(9))
def test_markers_of_several_arrays_are_one_message(length: int) -> None:
    points = np.array([[1.5, -2.5, 3.5], [0.5, 0.25, 0.125]])
    namespaces = ["x" * length, "", "ab"]
    parts = []
    for namespace in namespaces:
        markers = PackedMarkers(CdrWriter, namespace)
        color = (0.25, 0.5, 0.75, 1.0)
        markers.add(Marker.LINE_LIST, points, scale=(0.5, 0, 0), color=color, frame_locked=True)
        markers.add_deletion()
        markers.set_stamp(STAMP)
        markers.set_poses([0], (4.0, 5.0, 0.0))
        parts.append(markers)
    message = deserialize_message(join(parts, CdrWriter), MarkerArray)
    assert [each.ns for each in message.markers] == [name for name in namespaces for _ in (0, 1)]
    for lines, deletion in zip(message.markers[::2], message.markers[1::2], strict=True):
        assert [*leaves(lines.header)] == [*TIME, "map"]
        assert (lines.id, lines.type, lines.action) == (0, Marker.LINE_LIST, Marker.ADD)
        assert [*leaves(lines.pose)] == planar([(4, 5, 0)])
        assert [*leaves(lines.scale), *leaves(lines.color)] == [0.5, 0, 0, 0.25, 0.5, 0.75, 1]
        assert lines.frame_locked
        assert [*leaves(lines.points)] == points.ravel().tolist()
        assert (deletion.id, deletion.action) == (1, Marker.DELETE)
        assert [*deletion.points, *deletion.colors, deletion.text] == [""]
