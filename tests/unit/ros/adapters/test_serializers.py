"""Serialized values in both formats, compared with the fields of their definitions.

The fields of a message are a list: a tuple of a code of `struct` and numbers, a text, or a time
[ns]. The encoders of this file are independent of those of the program.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

import rospy

from flatland import values
from flatland.node import values as node_values
from flatland.node.adapters.marker import Marker, write_marker, write_markers
from flatland.node.adapters.people_markers import HEIGHT
from flatland.node.adapters.serializers import SERIALIZERS
from flatland.node.adapters.writer import FLOAT32, LAYOUTS, Writer
from flatland.node.stamps import set_stamps
from flatland.ros.adapters.writer import RosWriter
from flatland.ros2 import ros_time
from flatland.ros2.writer import CdrWriter

STAMP = 1_234_567_890_987_654_321
ANGLE = 0.3
TURNED = (0.0, 0.0, math.sin(ANGLE / 2), math.cos(ANGLE / 2))
# The roll, then the yaw: the product of the quaternion of the yaw and that of the roll.
ROLL = 2.5
TILTED = (
    TURNED[3] * math.sin(ROLL / 2),
    TURNED[2] * math.sin(ROLL / 2),
    TURNED[2] * math.cos(ROLL / 2),
    TURNED[3] * math.cos(ROLL / 2),
)


@dataclass(frozen=True)
class Time:
    """A time [ns]."""

    nanoseconds: int


@dataclass(frozen=True)
class Header:
    """A `std_msgs/Header`; of ROS 1, it begins with a sequence number."""

    stamp: int
    frame_id: str


@dataclass(frozen=True)
class Only:
    """Fields of one version of ROS."""

    version: int
    fields: tuple[Any, ...]


def ros1(*fields: Any) -> bytes:
    """Returns fields without padding."""
    data = b""
    for field in fields:
        match field:
            case Header(stamp, frame_id):
                data += ros1(("I", 0), Time(stamp), frame_id)
            case Time(nanoseconds):
                data += struct.pack("<II", nanoseconds // 10**9, nanoseconds % 10**9)
            case str():
                data += struct.pack("<I", len(field.encode())) + field.encode()
            case Only(version, parts):
                data += ros1(*parts) if version == 1 else b""
            case (code, *numbers):
                data += struct.pack(f"<{len(numbers)}{code}", *numbers)
    return data


def ros2(*fields: Any) -> bytes:
    """Returns fields with the padding of CDR, which starts after four bytes."""
    return b"\0\1\0\0" + _ros2(b"", fields)


def _ros2(data: bytes, fields: tuple[Any, ...]) -> bytes:
    for field in fields:
        match field:
            case Header(stamp, frame_id):
                data = _ros2(data, (Time(stamp), frame_id))
            case Time(nanoseconds):
                data = _ros2(data, (("i", nanoseconds // 10**9), ("I", nanoseconds % 10**9)))
            case str():
                data = _ros2(data, (("I", len(field.encode()) + 1),)) + field.encode() + b"\0"
            case Only(version, parts):
                data = _ros2(data, parts) if version == 2 else data
            case (code, *numbers):
                size = struct.calcsize(code)
                if numbers:
                    data += bytes(-len(data) % size)
                data += struct.pack(f"<{len(numbers)}{code}", *numbers)
    return data


FORMATS = [pytest.param(RosWriter, ros1, id="ROS 1"), pytest.param(CdrWriter, ros2, id="ROS 2")]


def fields_of_pose(x: float, y: float, rotation: tuple[float, ...] = TURNED) -> tuple[Any, ...]:
    return ("d", x, y, 0.0, *rotation)


def array(code: str, *numbers: float) -> list[Any]:
    return [("I", len(numbers)), (code, *numbers)]


def texts(*names: str) -> list[Any]:
    return [("I", len(names)), *names]


FLOATS = (0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5)
MATRIX = np.arange(36.0).reshape(6, 6) + 0.5
SMALL = [np.arange(9.0).reshape(3, 3) + 10.0 * number for number in range(3)]
ROWS = np.array([[1.0, 2.0, ANGLE], [4.0, 5.0, ANGLE]])
RANGES = np.array([7.0, 8.0, 9.0], np.float32)
GRID = values.OccupancyGrid((1.0, 2.0, ANGLE), 0.5, np.array([[0, 100, -1], [1, 2, 3]], np.int8))
METADATA = [Time(STAMP), ("f", 0.5), ("I", 3, 2), fields_of_pose(1.0, 2.0)]
TWISTS = [("d", x, y, 0.0, 0.0, 0.0, w) for x, y, w in ROWS]
POSES_2D = [("d", *row) for row in ROWS]
STATES = [("I", 2), *POSES_2D, ("I", 2), *TWISTS]
NAMES, GROUPS = ("anna", "bo"), ("walkers", "crew")


def cases(text: str) -> dict[str, tuple[Any, list[Any]]]:
    """Returns values with a text, and the fields of their messages."""
    header = Header(STAMP, text)
    contact = values.Collision(
        text, "a", "bc", "", np.array([3.0]), np.array([[1.0, 2.0]]), np.array([[0.0, 1.0]])
    )
    nothing = values.Collision("", "", "", text, np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)))
    label = values.SemanticLabel(text, "body", ("2d", text), "person")
    status = node_values.Status(text, node_values.Level.WARN, "slow", {"rate": text, "b": "2"})
    return {
        "bool": (True, [("B", 1)]),
        "twist": (values.Twist(1.0, 2.0, 3.0), [("d", 1.0, 2.0, 0.0, 0.0, 0.0, 3.0)]),
        "velocity": (
            values.TwistWithCovariance(STAMP, text, (1.0, 2.0, 3.0), MATRIX),
            [header, ("d", 1.0, 2.0, 0.0, 0.0, 0.0, 3.0), ("d", *MATRIX.ravel())],
        ),
        "pose": (
            values.PoseStamped(STAMP, text, (1.0, 2.0, ANGLE)),
            [header, fields_of_pose(1.0, 2.0)],
        ),
        "transform": (
            values.Transform(STAMP, text, "child", 1.0, 2.0, ANGLE, ROLL),
            [
                header,
                "child",
                fields_of_pose(1.0, 2.0, TILTED),
            ],
        ),
        "transforms": (
            node_values.Transforms(
                values.Transform(STAMP + number, "map", text, 1.0, 2.0, ANGLE)
                for number in range(2)
            ),
            [
                ("I", 2),
                *(
                    field
                    for number in range(2)
                    for field in (Header(STAMP + number, "map"), text, fields_of_pose(1.0, 2.0))
                ),
            ],
        ),
        "people": (
            values.People(STAMP, text, NAMES, ROWS),
            [header, ("I", 2), fields_of_pose(1.0, 2.0), fields_of_pose(4.0, 5.0)],
        ),
        "scan": (
            values.LaserScan(STAMP, text, *FLOATS, RANGES, RANGES[:1]),
            [header, ("f", *FLOATS), *array("f", *RANGES), *array("f", 7.0)],
        ),
        "imu": (
            values.Imu(STAMP, text, ANGLE, 3.0, (4.0, 5.0), *SMALL),
            [
                header,
                ("d", *TURNED),
                ("d", *SMALL[0].ravel()),
                ("d", 0.0, 0.0, 3.0),
                ("d", *SMALL[1].ravel()),
                ("d", 4.0, 5.0, 0.0),
                ("d", *SMALL[2].ravel()),
            ],
        ),
        "ultrasound": (
            values.Range(STAMP, text, "ultrasound", 0.5, 1.5, 2.5, 3.5),
            [header, ("B", 0), ("f", 0.5, 1.5, 2.5, 3.5), Only(2, (("f", 0.0),))],
        ),
        "infrared": (
            values.Range(STAMP, text, "infrared", 0.5, 1.5, 2.5, 3.5),
            [header, ("B", 1), ("f", 0.5, 1.5, 2.5, 3.5), Only(2, (("f", 0.0),))],
        ),
        "fix": (
            values.NavSatFix(STAMP, text, 1.0, 2.0, 3.0),
            [header, ("b", 0), ("H", 1), ("d", 1.0, 2.0, 3.0), ("d", *[0.0] * 9), ("B", 0)],
        ),
        "joints": (
            values.JointState(STAMP, ("left", text), (1.0, 2.0), (3.0, 4.0)),
            [
                Header(STAMP, ""),
                *texts("left", text),
                *array("d", 1.0, 2.0),
                *array("d", 3.0, 4.0),
                ("I", 0),
            ],
        ),
        "odometry": (
            values.Odometry(STAMP, text, "b", (1.0, 2.0, ANGLE), (3.0, 4.0, 5.0), MATRIX, -MATRIX),
            [
                header,
                "b",
                fields_of_pose(1.0, 2.0),
                ("d", *MATRIX.ravel()),
                ("d", 3.0, 4.0, 0.0, 0.0, 0.0, 5.0),
                ("d", *-MATRIX.ravel()),
            ],
        ),
        "metadata": (node_values.MapMetadata(STAMP, GRID), METADATA),
        "map": (
            node_values.PublishedMap(STAMP, GRID, text),
            [header, *METADATA, *array("b", 0, 100, -1, 1, 2, 3)],
        ),
        "diagnostics": (
            node_values.Diagnostics([status, replace(status, text="\udc80", values={})]),
            [
                Header(STAMP, ""),
                ("I", 2),
                *(("B", 1), text, "slow", "flatland", ("I", 2), "rate", text, "b", "2"),
                *(("B", 1), text, "?", "flatland", ("I", 0)),
            ],
        ),
        "collisions": (
            values.Collisions(STAMP, text, (contact, nothing)),
            [
                header,
                ("I", 2),
                *(text, "a", "bc", "", *array("d", 3.0)),
                *(("I", 1), ("d", 1.0, 2.0), ("I", 1), ("d", 0.0, 1.0)),
                *("", "", "", text, ("I", 0), ("I", 0), ("I", 0)),
            ],
        ),
        "semantic scan": (
            values.SemanticScan(
                *(STAMP, text, *FLOATS[:5], RANGES, np.array([0, 1, 1], np.uint32)),
                (values.SemanticLabel("", "", (), ""), label),
            ),
            [
                header,
                ("f", *FLOATS[:5]),
                *array("f", *RANGES),
                *array("I", 0, 1, 1),
                ("I", 2),
                *("", "", ("I", 0), ""),
                *(text, "body", *texts("2d", text), "person"),
            ],
        ),
        "people states": (
            values.PeopleStates(STAMP, text, NAMES, ROWS, GROUPS, ROWS, np.array([True, False])),
            [header, *texts(*NAMES), *texts(*GROUPS), *STATES, *array("B", 1, 0)],
        ),
        "model states": (
            node_values.StampedModelStates(STAMP, text, [text, "\udc80"], ["", text], ROWS, ROWS),
            [header, *texts(text, "?"), *texts("", text), *STATES],
        ),
        "tracked people": (
            values.TrackedPeople(STAMP, text, NAMES, ROWS, GROUPS, ROWS + 1.0, np.zeros(2, bool)),
            [
                header,
                ("I", 2),
                *("anna", ("d", 1.0, 2.0, 0.0, 2.0, 3.0, 0.0), ("d", 1.0)),
                *(*texts("group"), *texts("walkers")),
                *("bo", ("d", 4.0, 5.0, 0.0, 5.0, 6.0, 0.0), ("d", 1.0)),
                *(*texts("group"), *texts("crew")),
            ],
        ),
        "names": (node_values.DebugTopicNames(["model/r", text]), texts("model/r", text)),
    }


@pytest.fixture(autouse=True)
def now(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The ROS time of both versions is that of the stamps."""
    monkeypatch.setattr(rospy, "get_rostime", lambda: rospy.Time(*divmod(STAMP, 10**9)))
    ros_time.set_now(STAMP)
    yield
    ros_time.set_now(None)


@pytest.mark.parametrize("text", ["", "abc", "fünf"])
@pytest.mark.parametrize("name", cases(""))
@pytest.mark.parametrize(("writer", "encode"), FORMATS)
def test_a_message_has_the_fields_of_its_definition(
    writer: type[Writer], encode: Any, name: str, text: str
) -> None:
    value, fields = cases(text)[name]
    to = writer()
    SERIALIZERS[type(value)](value, to)
    assert bytes(to.data) == encode(*fields)


def test_all_messages_are_compared() -> None:
    compared = {type(value) for value, _ in cases("").values()}
    assert set(SERIALIZERS) - compared == {values.PeopleMarkers}


@pytest.mark.parametrize(("writer", "encode"), FORMATS)
def test_stamps_are_those_of_the_process(writer: type[Writer], encode: Any) -> None:
    """As with wall time: each simulated time has a stamp of its own."""
    set_stamps(lambda time_ns: time_ns + 1_000_000_001)
    try:
        to = writer()
        to.header(5, "map")
        to.time(6)
        marker = Marker(stamp=7)
        write_marker(marker, to)
    finally:
        set_stamps(None)
    expected = encode(Header(1_000_000_006, "map"), Time(1_000_000_007), Header(1_000_000_008, ""))
    assert bytes(to.data).startswith(expected)


@pytest.mark.parametrize("writer", [RosWriter, CdrWriter])
def test_arrays_of_other_shapes_are_refused(writer: type[Writer]) -> None:
    to = writer()
    with pytest.raises(ValueError, match="a covariance has 9 elements, got 8"):
        to.covariance(np.zeros(8), 3)
    for points in (np.zeros((2, 3)), np.zeros(2)):
        contact = values.Collision("", "", "", "", np.zeros(0), points, np.zeros((0, 2)))
        with pytest.raises(ValueError, match=r"points must have shape \(k, 2\), got "):
            SERIALIZERS[values.Collisions](values.Collisions(0, "", (contact,)), writer())
    for points in (np.zeros((2, 2)), np.zeros(3)):
        with pytest.raises(ValueError, match=r"points must have shape \(n, 3\), got "):
            write_marker(Marker(points=points), writer())


def test_lists_of_different_length_are_refused() -> None:
    tracked = values.TrackedPeople(STAMP, "", NAMES, ROWS[:1], GROUPS, ROWS, np.zeros(2, bool))
    with pytest.raises(ValueError, match=r"zip\(\) argument"):
        SERIALIZERS[values.TrackedPeople](tracked, RosWriter())
    for changes in ({"groups": GROUPS[:1]}, {"velocities": ROWS[:1]}, {"ids": (4,)}):
        with pytest.raises(ValueError, match=r"zip\(\) argument"):
            SERIALIZERS[values.PeopleMarkers](people(**changes), RosWriter())


def test_at_most_16_numbers_are_written_at_once() -> None:
    assert {len(layouts) for layouts in LAYOUTS.values()} == {17}


@pytest.mark.parametrize(("writer", "encode"), FORMATS)
def test_numbers_are_converted_to_the_type_of_their_field(
    writer: type[Writer], encode: Any
) -> None:
    to = writer()
    to.pack("B", 1)
    to.array(np.array([[1, 2], [3, 4]]).T, FLOAT32)
    to.array(np.zeros(0, int))
    to.pack("B", 1)
    to.numbers(np.array([5]))
    to.orientation(ANGLE)
    expected = [("B", 1), *array("f", 1.0, 3.0, 2.0, 4.0), ("I", 0), ("B", 1), ("d", 5.0)]
    assert bytes(to.data) == encode(*expected, ("d", *TURNED))


# -- markers ---------------------------------------------------------------------------------------


def fields_of_marker(marker: Marker, padding: str = "") -> list[Any]:
    """Returns the fields of a marker, for ROS 2 with a text of its texture."""
    points = marker.points.tolist()
    return [
        Header(marker.stamp or 0, marker.frame_id),
        marker.namespace,
        ("i", marker.number, marker.kind, marker.action),
        ("d", *marker.position, *marker.rotation, *marker.scale),
        ("f", *marker.color),
        ("i", 0, 0),
        ("B", marker.frame_locked),
        ("I", len(points)),
        *(("d", *point) for point in points),
        ("I", 0),
        Only(2, ("", Time(0), "", padding, ("I", 0), ("I", 0))),
        marker.text,
        "",
        Only(2, ("", ("I", 0))),
        ("B", 0),
        Only(2, (("I",),)),
    ]


def full_marker(text: str, points: int = 2) -> Marker:
    return Marker(
        *(f"layer {text}", 3, Marker.LINE_LIST, STAMP, f"map {text}", Marker.ADD),
        position=(1.0, 2.0, 3.0),
        rotation=(0.1, 0.2, 0.3, 0.4),
        scale=(4.0, 5.0, 6.0),
        color=(0.25, 0.5, 0.75, 1.0),
        frame_locked=True,
        points=np.arange(3.0 * points).reshape(points, 3),
        text=text,
    )


MARKERS = [Marker(), *(full_marker("x" * size, size % 3) for size in range(8))]


@pytest.mark.parametrize("number", range(len(MARKERS)))
def test_a_marker_has_the_fields_of_its_definition(number: int) -> None:
    marker = MARKERS[number]
    to: Writer = RosWriter()
    places = write_marker(marker, to)
    assert bytes(to.data) == ros1(*fields_of_marker(marker))
    _check_places(marker, bytes(to.data), places)

    to = CdrWriter()
    places = write_marker(marker, to)
    encoded = [_padded(ros2(*fields_of_marker(marker, padding))) for padding in ("", "    ")]
    assert bytes(to.data) in encoded
    # The next marker of an array begins four bytes after a multiple of eight.
    assert len(to.data) % 8 == 0
    _check_places(marker, bytes(to.data), places)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _check_places(marker: Marker, data: bytes, places: Any) -> None:
    """Asserts that stamp, pose and points begin where the result states it."""
    stamp = divmod(marker.stamp or 0, 10**9)
    assert struct.unpack_from("<2I", data, places.stamp) == stamp
    numbers = struct.unpack_from("<7d", data, places.pose)
    assert numbers == (*marker.position, *marker.rotation)
    points = np.frombuffer(data, "<f8", marker.points.size, places.points)
    assert points.tolist() == marker.points.ravel().tolist()


def test_an_array_of_markers_has_its_length() -> None:
    to = RosWriter()
    write_markers(MARKERS[:3], to)
    expected = b"".join(ros1(*fields_of_marker(marker)) for marker in MARKERS[:3])
    assert bytes(to.data) == ros1(("I", 3)) + expected


def people(**changes: Any) -> values.PeopleMarkers:
    value = values.PeopleMarkers(
        *(STAMP, "map", NAMES, ROWS, ("crew", "crew"), np.array([[0.5, 0.25, 0.1], [0.0, 1.0, 0]])),
        np.zeros(2, bool),
        ids=(4, 7),
        group_names=("walkers", "crew"),
        colors=((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 0.5)),
        radii=(0.25, 0.5),
        removed=(2,),
    )
    return replace(value, **changes)


def test_people_are_bodies_velocities_and_names() -> None:
    dark, at = (0.2, 0.2, 0.2, 1.0), (STAMP, "map")
    bodies = Marker("people", 1, Marker.SPHERE_LIST, *at, color=(0.0, 1.0, 0.0, 0.5))
    bodies.scale = (1.0, 1.0, 1.7)
    bodies.points = np.array([[1.0, 2.0, 0.85], [4.0, 5.0, 0.85]])
    lines = Marker("velocities", 0, Marker.LINE_LIST, *at, color=dark, scale=(0.05, 0.0, 0.0))
    lines.points = np.array(
        [[1.0, 2.0, HEIGHT], [1.5, 2.25, HEIGHT], [4.0, 5.0, HEIGHT], [4.0, 6.0, HEIGHT]]
    )
    names = [
        Marker(
            *("names", number, Marker.TEXT_VIEW_FACING, *at),
            color=dark,
            position=(x, y, 1.95),
            scale=(0.0, 0.0, 0.25),
            text=name,
        )
        for number, x, y, name in ((4, 1.0, 2.0, "anna"), (7, 4.0, 5.0, "bo"))
    ]
    deleted = [Marker("names", 2, action=2), Marker("people", 0, action=2)]
    _check_people(people(), [*deleted, bodies, lines, *names])
    _check_people(people(removed=None), [Marker(action=3), deleted[1], bodies, lines, *names])


def test_without_people_their_markers_are_deleted() -> None:
    nobody = people(
        names=(), groups=(), poses=np.zeros((0, 3)), velocities=np.zeros((0, 3)), ids=(), removed=()
    )
    groups = [Marker("people", number, action=2) for number in range(2)]
    _check_people(nobody, [*groups, Marker("velocities", 0, action=2)])


def _check_people(value: values.PeopleMarkers, markers: list[Marker]) -> None:
    to, expected = RosWriter(), RosWriter()
    SERIALIZERS[values.PeopleMarkers](value, to)
    write_markers(markers, expected)
    assert bytes(to.data) == bytes(expected.data)
