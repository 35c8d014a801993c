"""Messages of values with the classes of ROS, and adapters of other packages.

The bytes of all messages are compared with their definitions in `tests/unit/ros/adapters`.
"""

from __future__ import annotations

import math
import struct
from io import BytesIO
from typing import Any

import genpy
import numpy as np
import pytest
from geometry_msgs.msg import Twist as TwistMessage
from geometry_msgs.msg import Vector3
from rospy import Time
from std_msgs.msg import Bool, String

import flatland
from flatland import values
from flatland.node import values as node_values
from flatland.ros.adapters import find_adapter, register_adapter

STAMP = 1_234_567_890_987_654_321  # more digits than a float can represent
YAW = 2.0
SIN, COS = math.sin(1.0), math.cos(1.0)
MATRIX = np.arange(1.0, 37.0).reshape(6, 6)
SMALL = [np.arange(9.0).reshape(3, 3) + offset for offset in (1, 11, 21)]
RANGES = np.float32([1.5, math.inf, 0.125])
ROWS = np.arange(1.0, 13.0).reshape(2, 6)
GRID = flatland.OccupancyGrid((1.0, -2.0, YAW), 0.25, np.array([[0, 100, -1], [50, 0, 0]], np.int8))


def adapter_of(value: Any) -> Any:
    adapter = find_adapter(type(value))
    assert adapter is not None
    return adapter


def sent(value: Any) -> Any:
    """Returns the message of a value as received by a subscriber."""
    adapter = adapter_of(value)
    buffer = BytesIO()
    message = adapter.to_message(value)
    assert isinstance(message, adapter.message_type)
    message.serialize(buffer)
    if adapter.serialize is not None:
        assert adapter.serialize(value) == buffer.getvalue()
    received = adapter.message_type()
    received.deserialize(buffer.getvalue())
    return received


def fields(message: Any, path: str = "") -> dict[str, Any]:
    """Returns all fields of a message that are neither zero nor empty, by their paths."""
    if isinstance(message, genpy.Message):
        parts = [(f"{path}.{name}", getattr(message, name)) for name in message.__slots__]
    elif isinstance(message, list) and message and isinstance(message[0], genpy.Message):
        parts = [(f"{path}[{index}]", item) for index, item in enumerate(message)]
    else:
        value = message.to_nsec() if isinstance(message, genpy.Time) else message
        value = value if isinstance(value, (str, int, float)) else list(value)
        return {path.removeprefix("."): value} if value else {}
    return {name: value for part in parts for name, value in fields(part[1], part[0]).items()}


def prefixed(path: str, **given: Any) -> dict[str, Any]:
    return {f"{path}.{name}": value for name, value in given.items()}


def pose(path: str, x: float = 1.0, y: float = -2.0) -> dict[str, Any]:
    return prefixed(f"{path}position", x=x, y=y) | prefixed(f"{path}orientation", z=SIN, w=COS)


def twist(path: str, x: float, y: float, omega: float) -> dict[str, Any]:
    return prefixed(f"{path}.linear", x=x, y=y) | {f"{path}.angular.z": omega}


def states() -> dict[str, Any]:
    """Returns the poses and velocities of `ROWS`."""
    found: dict[str, Any] = {}
    for number, (x, y, theta, *velocity) in enumerate(ROWS):
        found |= prefixed(f"pose[{number}]", x=x, y=y, theta=theta)
        found |= twist(f"twist[{number}]", *velocity)
    return found


METADATA = {"resolution": 0.25, "width": 3, "height": 2, "map_load_time": STAMP} | pose("origin.")
# A value of each type, the type of its message, and the fields without those of the header.
CASES: list[tuple[Any, str, dict[str, Any]]] = [
    (True, "std_msgs/Bool", {"data": True}),
    (
        flatland.LaserScan(STAMP, "map", -1.0, 2.0, 0.5, 0.125, 0.25, 0.375, 30.0, RANGES, RANGES),
        "sensor_msgs/LaserScan",
        {"angle_min": -1.0, "angle_max": 2.0, "angle_increment": 0.5, "time_increment": 0.125}
        | {"scan_time": 0.25, "range_min": 0.375, "range_max": 30.0}
        | {"ranges": list(RANGES), "intensities": list(RANGES)},
    ),
    (
        flatland.Odometry(STAMP, "map", "base", (1.0, -2.0, YAW), (3.0, 4.0, 5.0), MATRIX, -MATRIX),
        "nav_msgs/Odometry",
        {"child_frame_id": "base", **pose("pose.pose."), **twist("twist.twist", 3.0, 4.0, 5.0)}
        | {"pose.covariance": [*range(1, 37)], "twist.covariance": [*range(-1, -37, -1)]},
    ),
    (
        flatland.PoseStamped(STAMP, "map", (1.0, -2.0, YAW)),
        "geometry_msgs/PoseStamped",
        pose("pose."),
    ),
    (
        flatland.Range(STAMP, "map", "infrared", 0.5, 0.125, 4.0, math.inf),
        "sensor_msgs/Range",
        {"radiation_type": 1, "field_of_view": 0.5, "min_range": 0.125, "max_range": 4.0}
        | {"range": math.inf},
    ),
    (
        flatland.SemanticScan(
            *(STAMP, "map", -1.0, 0.5, 0.25, 0.125, 8.0, RANGES, np.uint32([1, 0, 1])),
            (flatland.SemanticLabel("chair1", "leg", ("2d", "3d"), "chair"),),
        ),
        "flatland/SemanticScan",
        {"angle_min": -1.0, "angle_max": 0.5, "angle_increment": 0.25, "range_min": 0.125}
        | {"range_max": 8.0, "ranges": list(RANGES), "labels": [1, 0, 1]}
        | prefixed("table[0]", name="chair1", body="leg", layers=["2d", "3d"], class_name="chair"),
    ),
    (
        flatland.TwistWithCovariance(STAMP, "map", (1.0, 2.0, 3.0), MATRIX),
        "geometry_msgs/TwistWithCovarianceStamped",
        {**twist("twist.twist", 1.0, 2.0, 3.0), "twist.covariance": [*range(1, 37)]},
    ),
    (
        flatland.Imu(STAMP, "map", YAW, 0.5, (2.0, 3.0), *SMALL),
        "sensor_msgs/Imu",
        prefixed("orientation", z=SIN, w=COS)
        | {"angular_velocity.z": 0.5, **prefixed("linear_acceleration", x=2.0, y=3.0)}
        | {"orientation_covariance": [*range(1, 10)]}
        | {"angular_velocity_covariance": [*range(11, 20)]}
        | {"linear_acceleration_covariance": [*range(21, 30)]},
    ),
    (
        flatland.NavSatFix(STAMP, "map", 43.123456789, -80.987654321, 3.0),
        "sensor_msgs/NavSatFix",
        {"latitude": 43.123456789, "longitude": -80.987654321, "altitude": 3.0}
        | {"status.service": 1, "position_covariance": [0.0] * 9},
    ),
    (
        flatland.Collisions(
            *(STAMP, "map"),
            (
                flatland.Collision(
                    *("robot", "base", "2d", "wall", np.array([1.0])),
                    *(np.array([[3.0, 4.0]]), np.array([[5.0, 6.0]])),
                ),
            ),
        ),
        "flatland/Collisions",
        prefixed("collisions[0]", entity_A="robot", body_A="base", entity_B="2d", body_B="wall")
        | {"collisions[0].magnitude_forces": [1.0]}
        | prefixed("collisions[0].contact_positions[0]", x=3.0, y=4.0)
        | prefixed("collisions[0].contact_normals[0]", x=5.0, y=6.0),
    ),
    (
        values.People(STAMP, "map", ("a", "b"), np.array([(1.0, -2.0, YAW), (3.0, 4.0, YAW)])),
        "geometry_msgs/PoseArray",
        pose("poses[0].") | pose("poses[1].", 3.0, 4.0),
    ),
    (
        values.PeopleStates(
            *(STAMP, "map", ("a", "b"), ROWS[:, :3], ("staff", "guests"), ROWS[:, 3:]),
            np.array([True, False]),
        ),
        "flatland/PeopleStates",
        {"name": ["a", "b"], "group": ["staff", "guests"], "standing": [True, False], **states()},
    ),
    (
        node_values.StampedModelStates(
            STAMP, "map", ("r1", "b"), ("fleet", ""), ROWS[:, :3], ROWS[:, 3:]
        ),
        "flatland/ModelStates",
        {"name": ["r1", "b"], "ns": ["fleet", ""], **states()},
    ),
    (
        flatland.JointState(STAMP, ("left", "right"), (1.0, 2.0), (3.0, 4.0)),
        "sensor_msgs/JointState",
        {"name": ["left", "right"], "position": [1.0, 2.0], "velocity": [3.0, 4.0]},
    ),
    (node_values.MapMetadata(STAMP, GRID), "nav_msgs/MapMetaData", METADATA),
    (
        node_values.PublishedMap(STAMP, GRID, "map"),
        "nav_msgs/OccupancyGrid",
        {f"info.{name}": value for name, value in METADATA.items()}
        | {"data": [0, 100, -1, 50, 0, 0]},  # row by row, that at the bottom first
    ),
    (
        node_values.DebugTopicNames(("layer/2d",)),
        "flatland/DebugTopicList",
        {"topics": ["layer/2d"]},
    ),
    (
        flatland.Transform(STAMP, "map", "laser", 1.0, -2.0, YAW, math.pi),
        "geometry_msgs/TransformStamped",
        {"child_frame_id": "laser", **prefixed("transform.translation", x=1.0, y=-2.0)}
        | prefixed("transform.rotation", x=COS, y=SIN, z=pytest.approx(0), w=pytest.approx(0)),
    ),
    (
        node_values.Transforms([flatland.Transform(STAMP, "map", "laser", 1.0, -2.0, YAW)]),
        "tf2_msgs/TFMessage",
        {
            f"transforms[0].{name}": value
            for name, value in (
                {"header.stamp": STAMP, "header.frame_id": "map", "child_frame_id": "laser"}
                | prefixed("transform.translation", x=1.0, y=-2.0)
                | prefixed("transform.rotation", z=SIN, w=COS)
            ).items()
        },
    ),
]


@pytest.mark.parametrize(("value", "kind", "expected"), CASES, ids=[case[1] for case in CASES])
def test_fields_of_a_message(value: Any, kind: str, expected: dict[str, Any]) -> None:
    message = sent(value)
    assert message._type == kind
    found = fields(message)
    header = {"header.stamp": STAMP, "header.frame_id": "" if "JointState" in kind else "map"}
    if "header" in message.__slots__:
        expected = expected | {name: value for name, value in header.items() if value}
    assert found == expected


@pytest.mark.parametrize(
    "numbers",
    [
        np.arange(36),
        np.arange(36, dtype=np.float32),
        np.arange(72.0)[::2] / 2,
        np.arange(36, dtype=">f4"),
    ],
    ids=["integers", "float32", "strided", "big-endian"],
)
def test_arrays_of_any_layout(numbers: Any) -> None:
    scan = flatland.LaserScan(0, "l", 0, 1, 1, 0, 0, 0, 1, numbers, numbers[:0])
    assert list(sent(scan).ranges) == list(range(36))
    matrix = numbers.reshape(6, 6).T
    message = sent(flatland.TwistWithCovariance(7, "base", (1.0, 2.0, 3.0), matrix))
    assert list(message.twist.covariance) == matrix.ravel().tolist()


def test_text_that_cannot_be_encoded_is_sent_as_printable_text(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("rospy.get_rostime", lambda: Time(12, 34))  # no node has been started
    level = node_values.Level
    statuses = (
        node_values.Status("loop", level.OK, "fine", {}),
        node_values.Status("plugins", level.ERROR, "late", {"\udcff": "3 times"}),
    )
    message = sent(node_values.Diagnostics(statuses))
    assert (message.header.stamp, message.header.frame_id) == (Time(12, 34), "")
    first, second = message.status
    assert (first.level, first.name, first.message, first.values) == (0, "loop", "fine", [])
    assert (second.level, second.name, second.message) == (2, "plugins", "late")
    assert {each.hardware_id for each in message.status} == {"flatland"}
    [found] = second.values
    assert found.key.isprintable()
    assert found.value == "3 times"


@pytest.mark.parametrize(
    "value",
    [
        flatland.Odometry(0, "odom", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), np.zeros((6, 5))),
        flatland.NavSatFix(0, "gps", "north", 0.0, 0.0),  # type: ignore[arg-type]
        flatland.NavSatFix(-1, "gps", 0.0, 0.0, 0.0),
        flatland.NavSatFix(0, "\ud800", 0.0, 0.0, 0.0),
    ],
    ids=["covariance", "text", "stamp", "surrogate"],
)
def test_values_without_a_message_raise(value: Any) -> None:
    with pytest.raises((struct.error, ValueError)):
        adapter_of(value).serialize(value)


def test_bool_and_twist_are_converted_in_both_directions() -> None:
    assert adapter_of(True).from_message(Bool(False)) is False
    message = TwistMessage(Vector3(1, 2, 3), Vector3(4, 5, 6))
    drive = flatland.Twist(1, 2, 6)
    assert adapter_of(drive).from_message(message) == drive
    assert sent(drive) == TwistMessage(Vector3(1, 2, 0), Vector3(0, 0, 6))


class Word(str):
    __slots__ = ()


def test_adapter_of_a_base_class() -> None:
    assert find_adapter(Word) is None
    register_adapter(str, String, String)
    assert adapter_of(Word()).message_type is String
    assert find_adapter(dict) is None


def test_registration_replaces_a_built_in_adapter() -> None:
    fix = flatland.NavSatFix(0, "gps", 0, 0, 0)
    built_in = adapter_of(fix)
    register_adapter(flatland.NavSatFix, String, lambda fix: String(fix.frame_id))
    try:
        assert sent(fix).data == "gps"
    finally:
        register_adapter(
            flatland.NavSatFix,
            built_in.message_type,
            built_in.to_message,
            built_in.from_message,
            built_in.serialize,
        )


def test_adapter_without_functions_raises() -> None:
    with pytest.raises(ValueError, match="an adapter for int needs at least one function"):
        register_adapter(int, String)


def test_adapter_that_only_serializes_converts_to_messages_too() -> None:
    text = b"\5\0\0\0seven"
    register_adapter(complex, String, serialize=lambda _value: text)
    assert sent(7j).data == "seven"
