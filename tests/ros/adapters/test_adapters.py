"""Conversion of values to messages: every field after serialization."""

from __future__ import annotations

import math
from io import BytesIO
from typing import Any

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


def sent(value: Any) -> Any:
    """Returns the message of a value as received by a subscriber."""
    adapter = find_adapter(type(value))
    assert adapter is not None
    assert adapter.to_message is not None
    buffer = BytesIO()
    message = adapter.to_message(value)
    assert isinstance(message, adapter.message_type)
    message.serialize(buffer)
    received = adapter.message_type()
    received.deserialize(buffer.getvalue())
    return received


def header(message: Any) -> tuple[int, int, str]:
    stamp = message.header.stamp
    return (stamp.secs, stamp.nsecs, message.header.frame_id)


def quaternion(rotation: Any) -> tuple[float, float, float, float]:
    return (rotation.x, rotation.y, rotation.z, rotation.w)


def test_laser_scan() -> None:
    ranges = np.array([1.5, np.nan, np.inf, 0.1], dtype=np.float32)
    scan = flatland.LaserScan(
        STAMP, "r1_laser", -1.0, 2.0, 0.5, 0.1, 0.2, 0.3, 30.0, ranges, np.float32([255, 0, 0, 255])
    )
    message = sent(scan)
    assert header(message) == (1_234_567_890, 987_654_321, "r1_laser")
    got = [
        message.angle_min,
        message.angle_max,
        message.angle_increment,
        message.time_increment,
        message.scan_time,
        message.range_min,
        message.range_max,
    ]
    assert got == pytest.approx([-1.0, 2.0, 0.5, 0.1, 0.2, 0.3, 30.0], rel=1e-6)
    np.testing.assert_array_equal(np.float32(message.ranges), ranges)
    assert list(message.intensities) == [255, 0, 0, 255]


@pytest.mark.parametrize(
    "ranges",
    [
        np.arange(10, dtype=np.float64),
        np.arange(20, dtype=np.float32)[::2] / 2,
        np.arange(10, dtype=">f4"),
    ],
    ids=["float64", "strided", "big-endian"],
)
def test_laser_scan_of_any_array_layout(ranges: Any) -> None:
    scan = flatland.LaserScan(0, "l", 0, 1, 1, 0, 0, 0, 1, ranges, np.zeros(0, np.float32))
    assert list(sent(scan).ranges) == list(range(10))


def test_odometry() -> None:
    pose_covariance = np.arange(36.0).reshape(6, 6)
    value = flatland.Odometry(
        STAMP, "odom", "r1_base", (1.0, -2.0, 2.0), (0.5, 0.25, -0.75), pose_covariance
    )
    message = sent(value)
    assert header(message) == (1_234_567_890, 987_654_321, "odom")
    assert message.child_frame_id == "r1_base"
    position = message.pose.pose.position
    assert (position.x, position.y, position.z) == (1.0, -2.0, 0.0)
    assert quaternion(message.pose.pose.orientation) == (0, 0, math.sin(1.0), math.cos(1.0))
    twist = message.twist.twist
    assert (twist.linear.x, twist.linear.y, twist.linear.z) == (0.5, 0.25, 0)
    assert (twist.angular.x, twist.angular.y, twist.angular.z) == (0, 0, -0.75)
    assert list(message.pose.covariance) == list(range(36))  # row by row
    assert list(message.twist.covariance) == [0.0] * 36


def test_pose_stamped() -> None:
    message = sent(flatland.PoseStamped(STAMP, "map", (1.0, -2.0, 2.0)))
    assert header(message) == (1_234_567_890, 987_654_321, "map")
    position = message.pose.position
    assert (position.x, position.y, position.z) == (1.0, -2.0, 0.0)
    assert quaternion(message.pose.orientation) == (0, 0, math.sin(1.0), math.cos(1.0))


def test_range() -> None:
    message = sent(flatland.Range(STAMP, "sonar", "infrared", 0.5, 0.1, 4.0, math.inf))
    assert header(message) == (1_234_567_890, 987_654_321, "sonar")
    assert message.radiation_type == message.INFRARED
    assert message.field_of_view == pytest.approx(0.5)
    assert (message.min_range, message.max_range) == pytest.approx((0.1, 4.0))
    assert message.range == math.inf
    other = sent(flatland.Range(0, "sonar", "ultrasound", 0.5, 0.1, 4.0, 1.0))
    assert (other.radiation_type, other.range) == (other.ULTRASOUND, 1.0)


def test_semantic_scan() -> None:
    table = (
        flatland.SemanticLabel("", "", (), ""),
        flatland.SemanticLabel("chair1", "leg", ("2d", "3d"), "chair"),
    )
    ranges, labels = np.float32([1.5, math.nan]), np.uint32([1, 0])
    message = sent(
        flatland.SemanticScan(STAMP, "eye", -1.0, 0.5, 0.25, 0.125, 8.0, ranges, labels, table)
    )
    assert header(message) == (1_234_567_890, 987_654_321, "eye")
    assert (message.angle_min, message.angle_max, message.angle_increment) == (-1.0, 0.5, 0.25)
    assert (message.range_min, message.range_max) == (0.125, 8.0)
    np.testing.assert_array_equal(message.ranges, ranges)
    assert list(message.labels) == [1, 0]
    assert [
        (label.name, label.body, tuple(label.layers), label.class_name) for label in message.table
    ] == [("", "", (), ""), ("chair1", "leg", ("2d", "3d"), "chair")]


def test_twist_with_covariance() -> None:
    covariance = np.arange(36.0).reshape(6, 6)
    message = sent(flatland.TwistWithCovariance(STAMP, "base", (1.0, 2.0, 3.0), covariance))
    assert header(message) == (1_234_567_890, 987_654_321, "base")
    twist = message.twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (1.0, 2.0, 3.0)
    assert list(message.twist.covariance) == list(range(36))


def test_imu() -> None:
    covariances = [np.arange(9.0).reshape(3, 3) + offset for offset in (0, 10, 20)]
    message = sent(flatland.Imu(STAMP, "imu", 1.0, 0.5, (2.0, 3.0), *covariances))
    assert header(message) == (1_234_567_890, 987_654_321, "imu")
    assert quaternion(message.orientation) == (0, 0, math.sin(0.5), math.cos(0.5))
    rate, acceleration = message.angular_velocity, message.linear_acceleration
    assert (rate.x, rate.y, rate.z) == (0, 0, 0.5)
    assert (acceleration.x, acceleration.y, acceleration.z) == (2, 3, 0)
    assert list(message.orientation_covariance) == list(range(9))
    assert list(message.angular_velocity_covariance) == list(range(10, 19))
    assert list(message.linear_acceleration_covariance) == list(range(20, 29))


def test_nav_sat_fix() -> None:
    message = sent(flatland.NavSatFix(STAMP, "gps", 43.123456789, -80.987654321, 0.0))
    assert header(message) == (1_234_567_890, 987_654_321, "gps")
    assert (message.latitude, message.longitude, message.altitude) == (
        43.123456789,
        -80.987654321,
        0.0,
    )
    assert (message.status.status, message.status.service) == (0, 1)
    assert message.position_covariance_type == 0


def test_collisions() -> None:
    collision = flatland.Collision(
        "robot",
        "base",
        "2d",
        "2d",
        np.array([1.0, 2.0]),
        np.array([[3.0, 4.0], [5.0, 6.0]]),
        np.array([[0.0, 1.0], [1.0, 0.0]]),
    )
    sensor = flatland.Collision(
        "robot", "fork", "box", "top", np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2))
    )
    message = sent(flatland.Collisions(STAMP, "map", (collision, sensor)))
    assert header(message) == (1_234_567_890, 987_654_321, "map")
    first, second = message.collisions
    assert (first.entity_A, first.body_A, first.entity_B, first.body_B) == (
        "robot",
        "base",
        "2d",
        "2d",
    )
    assert list(first.magnitude_forces) == [1.0, 2.0]
    assert [(p.x, p.y) for p in first.contact_positions] == [(3.0, 4.0), (5.0, 6.0)]
    assert [(p.x, p.y) for p in first.contact_normals] == [(0.0, 1.0), (1.0, 0.0)]
    assert second.body_A == "fork"
    assert (list(second.magnitude_forces), second.contact_positions) == ([], [])


def test_people() -> None:
    poses = np.array([(1.0, 2.0, 2.0), (3.0, 4.0, 0.0)])
    message = sent(values.People(STAMP, "map", ("a", "b"), poses))
    assert header(message) == (1_234_567_890, 987_654_321, "map")
    assert [(p.position.x, p.position.y, p.position.z) for p in message.poses] == [
        (1.0, 2.0, 0.0),
        (3.0, 4.0, 0.0),
    ]
    assert quaternion(message.poses[0].orientation) == (0, 0, math.sin(1.0), math.cos(1.0))


def states_of(message: Any) -> list[tuple[float, ...]]:
    """Returns the pose and the velocity of each model or person, after a check of the rest."""
    assert header(message) == (1_234_567_890, 987_654_321, "map")
    assert all((t.linear.z, t.angular.x, t.angular.y) == (0, 0, 0) for t in message.twist)
    return [
        (pose.x, pose.y, pose.theta, twist.linear.x, twist.linear.y, twist.angular.z)
        for pose, twist in zip(message.pose, message.twist, strict=True)
    ]


STATES = np.arange(12.0).reshape(2, 6)


def test_people_states() -> None:
    message = sent(
        values.PeopleStates(
            STAMP,
            "map",
            ("a", "b"),
            STATES[:, :3],
            ("staff", "guests"),
            STATES[:, 3:],
            np.array([True, False]),
        )
    )
    assert (message.name, message.group) == (["a", "b"], ["staff", "guests"])
    np.testing.assert_array_equal(states_of(message), STATES)
    assert list(message.standing) == [True, False]


def test_model_states() -> None:
    names = ("r1", "\udcff")  # undecodable bytes cannot be sent
    message = sent(
        node_values.StampedModelStates(
            STAMP, "map", names, ("fleet", ""), STATES[:, :3], STATES[:, 3:]
        )
    )
    assert message.name[0] == "r1"
    assert message.name[1].isprintable()
    assert message.ns == ["fleet", ""]
    np.testing.assert_array_equal(states_of(message), STATES)


def test_joint_state() -> None:
    message = sent(flatland.JointState(STAMP, ("left", "right"), (1.0, 2.0), (3.0, 4.0)))
    assert header(message) == (1_234_567_890, 987_654_321, "")
    assert message.name == ["left", "right"]
    assert (list(message.position), list(message.velocity)) == ([1.0, 2.0], [3.0, 4.0])
    assert list(message.effort) == []


GRID = flatland.OccupancyGrid((1.0, -2.0, 2.0), 0.25, np.array([[0, 100, -1], [50, 0, 0]], np.int8))


def check_metadata(message: Any) -> None:
    stamp = message.map_load_time
    assert (stamp.secs, stamp.nsecs) == (1_234_567_890, 987_654_321)
    assert (message.resolution, message.width, message.height) == (0.25, 3, 2)
    origin = message.origin
    assert (origin.position.x, origin.position.y, origin.position.z) == (1.0, -2.0, 0.0)
    assert quaternion(origin.orientation) == (0, 0, math.sin(1.0), math.cos(1.0))


def test_map() -> None:
    check_metadata(sent(node_values.MapMetadata(STAMP, GRID)))
    message = sent(node_values.PublishedMap(STAMP, GRID, "floor"))
    assert header(message) == (1_234_567_890, 987_654_321, "floor")
    check_metadata(message.info)
    assert list(message.data) == [0, 100, -1, 50, 0, 0]  # row by row, that at the bottom first


def test_diagnostics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rospy.get_rostime", lambda: Time(12, 34))  # no node has been started
    level = node_values.Level
    statuses = (
        node_values.Status("loop", level.OK, "fine", {}),
        node_values.Status("plugins", level.ERROR, "late", {"laser": "3 times", "\udcff": "1"}),
    )
    message = sent(node_values.Diagnostics(statuses))
    assert header(message) == (12, 34, "")
    first, second = message.status
    assert (first.level, first.name, first.message, first.values) == (0, "loop", "fine", [])
    assert (second.level, second.name, second.message) == (2, "plugins", "late")
    assert {each.hardware_id for each in message.status} == {"flatland"}
    laser, other = second.values
    assert (laser.key, laser.value) == ("laser", "3 times")
    assert other.key.isprintable()


def test_names_of_debug_topics() -> None:
    assert sent(node_values.DebugTopicNames(("layer/2d", "model/r"))).topics == [
        "layer/2d",
        "model/r",
    ]


def test_bool_and_twist_are_converted_in_both_directions() -> None:
    assert sent(True).data is True
    switch = find_adapter(bool)
    assert switch is not None
    assert switch.from_message is not None
    assert switch.from_message(Bool(False)) is False
    drive = find_adapter(flatland.Twist)
    assert drive is not None
    assert drive.from_message is not None
    message = TwistMessage(Vector3(1, 2, 3), Vector3(4, 5, 6))
    assert drive.from_message(message) == flatland.Twist(1, 2, 6)
    assert sent(flatland.Twist(1, 2, 6)) == TwistMessage(Vector3(1, 2, 0), Vector3(0, 0, 6))


@pytest.mark.parametrize(
    ("yaw", "roll"), [(0.0, 0.0), (0.7, 0.0), (-2.5, 0.0), (0.7, math.pi), (-2.5, 1.2)]
)
def test_transform_applies_roll_before_yaw(yaw: float, roll: float) -> None:
    message = sent(flatland.Transform(STAMP, "base", "laser", 0.5, -0.25, yaw, roll))
    assert header(message) == (1_234_567_890, 987_654_321, "base")
    assert message.child_frame_id == "laser"
    translation = message.transform.translation
    assert (translation.x, translation.y, translation.z) == (0.5, -0.25, 0.0)
    x, y, z, w = quaternion(message.transform.rotation)
    assert math.hypot(x, y, z, w) == pytest.approx(1)
    got = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    c, s, cr, sr = math.cos(yaw), math.sin(yaw), math.cos(roll), math.sin(roll)
    yaw_matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    roll_matrix = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    np.testing.assert_allclose(got, yaw_matrix @ roll_matrix, atol=1e-12)


class Word(str):
    __slots__ = ()


def test_adapter_of_a_base_class() -> None:
    assert find_adapter(Word) is None
    register_adapter(str, String, String)
    adapter = find_adapter(Word)
    assert adapter is not None
    assert adapter.message_type is String
    assert find_adapter(dict) is None


def test_registration_replaces_a_built_in_adapter() -> None:
    built_in = find_adapter(flatland.NavSatFix)
    assert built_in is not None
    register_adapter(flatland.NavSatFix, String, lambda fix: String(fix.frame_id))
    try:
        assert sent(flatland.NavSatFix(0, "gps", 0, 0, 0)).data == "gps"
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
