"""Messages of sensors and holonomic drives: one real message each, compared with closed forms.

A shuttle drives along the x axis at a constant speed from time 0 on. All that its sensors measure
follows from the stamp of the message.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState, Range
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from flatland.msg import SemanticScan

START, SPEED = -3.0, 0.5  # m, m/s; the nearest wall ahead is at 5 m
SONAR, ARM = 0.3, 0.4  # m; distances from the centre of the shuttle
RADIUS, TICKS = 0.1, 64  # of the wheel [m], per turn
POST = 2.5  # m; x of the nearest point of the post
SHUTTLE = f"""
class: vehicle
bodies:
  - {{name: base, type: kinematic, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}
plugins:
  - {{type: PathFollower, name: path, waypoints: [[5, 0]], mode: once, speed: {SPEED}}}
  - {{type: PosePublisher, name: pose, update_rate: 10, origin: [{ARM}, 0, 0]}}
  - {{type: PosePublisher, name: truth, update_rate: 20, message: odometry, origin: [0, {ARM}, 1],
     child_frame_id: arm, frame_id: world}}
  - {{type: Sonar, name: eye, body: base, range: 6, range_min: 0.1, field_of_view: 0.1,
     origin: [{SONAR}, 0, 0], update_rate: 5, radiation_type: infrared}}
  - {{type: SemanticScan, name: labels, body: base, range: 6, update_rate: 10, layers: [2d],
     angle: {{min: 0, max: 1.5708, increment: 0.7854}}, broadcast_tf: false, frame: /scanner}}
  - {{type: WheelStates, name: wheels, update_rate: 10, ticks_per_turn: {TICKS},
     wheels: [{{name: left, position: [0, 0.2], radius: {RADIUS}}}]}}
  - {{type: Hitch, name: hitch, origin: [-0.25, 0], start: true, collide: true}}
"""
TRAILER = "bodies: [{name: box, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
PLANT = """
class: plant
bodies:
  - {name: pot, type: static, footprints: [{type: circle, radius: 0.5, density: 0, layers: [2d]}]}
"""
OMNI = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: OmniDrive, name: drive, body: base, pub_rate: 20, layout: mecanum, wheelbase: 0.4,
     track: 0.4, max_wheel_speed: 1}
"""
MODELS = f"""
  - {{name: shuttle, model: shuttle.model.yaml, namespace: s, pose: [{START}, 0, 0]}}
  - {{name: trailer, model: trailer.model.yaml, pose: [{START - 0.5}, 0, 0]}}
  - {{name: plant, model: plant.model.yaml, pose: [{POST + 0.5}, 0, 0]}}
  - {{name: omni, model: omni.model.yaml, namespace: o, pose: [0, -3, 0]}}
"""
TOPICS: dict[str, type[Any]] = {
    "/s/pose": PoseStamped,
    "/s/odometry": Odometry,
    "/s/range": Range,
    "/s/semantic_scan": SemanticScan,
    "/s/joint_states": JointState,
    "/s/hitched": Bool,
    "/tf": TFMessage,
}


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """One server in lockstep for all tests of this file."""
    world = write_world(
        MODELS,
        layers="[{name: 2d, map: map.yaml, class: wall}]",
        shuttle=SHUTTLE,
        trailer=TRAILER,
        plant=PLANT,
        omni=OMNI,
    )
    return module_launcher.server(world, lockstep=True, seed=7)


@pytest.fixture(scope="module")
def messages(module_ros: Any, server: Any) -> dict[str, Any]:
    """The second message on each topic, and all of /tf; subscribed before the first step."""
    topics = {name: module_ros.ready_topic(name, kind) for name, kind in TOPICS.items()}
    module_ros.step(0.405)
    found = {name: topic.take(2)[-1] for name, topic in topics.items() if name != "/tf"}
    transforms = found["/tf"] = []
    while not transforms or transforms[-1].header.stamp.to_sec() < 0.4:
        transforms += topics["/tf"].next().transforms
    return found


def checked_stamp(message: Any, expected: float, frame: str) -> float:
    """Checks the header of a message, and returns its time [s]."""
    stamp: float = message.header.stamp.to_sec()
    assert stamp == pytest.approx(expected)
    assert message.header.frame_id == frame
    return stamp


def test_pose(messages: dict[str, Any]) -> None:
    message = messages["/s/pose"]
    time = checked_stamp(message, 0.1, "map")
    position, rotation = message.pose.position, message.pose.orientation
    assert (position.x, position.y, position.z) == pytest.approx(
        (START + SPEED * time + ARM, 0, 0), abs=1e-5
    )
    assert (rotation.x, rotation.y, rotation.z, rotation.w) == (0, 0, 0, 1)


def test_odometry(messages: dict[str, Any]) -> None:
    message = messages["/s/odometry"]
    time = checked_stamp(message, 0.05, "world")
    assert message.child_frame_id == "s_arm"
    pose, twist = message.pose.pose, message.twist.twist
    assert (pose.position.x, pose.position.y) == pytest.approx((START + SPEED * time, ARM))
    assert 2 * math.atan2(pose.orientation.z, pose.orientation.w) == pytest.approx(1.0)
    expected = (SPEED * math.cos(1), -SPEED * math.sin(1), 0)
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == pytest.approx(expected, abs=1e-4)
    assert set(message.pose.covariance) == set(message.twist.covariance) == {0.0}


def test_range(messages: dict[str, Any]) -> None:
    message = messages["/s/range"]
    time = checked_stamp(message, 0.2, "s_eye")
    assert message.radiation_type == Range.INFRARED
    fields = (message.field_of_view, message.min_range, message.max_range)
    assert fields == pytest.approx((0.1, 0.1, 6))
    assert message.range == pytest.approx(POST - (START + SPEED * time + SONAR), abs=1e-4)


def test_transform_of_the_sonar(messages: dict[str, Any]) -> None:
    sonar = [each for each in messages["/tf"] if each.child_frame_id == "s_eye"]
    assert [each.header.stamp.to_sec() for each in sonar] == pytest.approx([0, 0.2, 0.4])
    for each in sonar:
        assert each.header.frame_id == "s_base"
        assert each.transform.translation == Vector3(SONAR, 0, 0)
    assert "scanner" not in {each.child_frame_id for each in messages["/tf"]}


def test_semantic_scan(messages: dict[str, Any]) -> None:
    message = messages["/s/semantic_scan"]
    time = checked_stamp(message, 0.1, "scanner")
    angles = (message.angle_min, message.angle_max, message.angle_increment)
    assert angles == pytest.approx((0, 1.5708, 0.7854))
    assert (message.range_min, message.range_max) == (0, 6)
    ahead, miss, side = message.ranges
    assert ahead == pytest.approx(POST - (START + SPEED * time), abs=1e-4)
    assert math.isnan(miss)
    assert side == pytest.approx(5, abs=1e-4)
    assert message.labels[1] == 0
    labels = [message.table[index] for index in message.labels]
    assert [(label.name, label.body, label.layers, label.class_name) for label in labels] == [
        ("plant", "pot", ["2d"], "plant"),
        ("", "", [], ""),
        ("2d", "2d", ["2d"], "wall"),
    ]


def test_joint_states(messages: dict[str, Any]) -> None:
    message = messages["/s/joint_states"]
    time = checked_stamp(message, 0.2, "")  # after the step; there is none at time 0
    assert message.name == ["left"]
    turns = SPEED * time / RADIUS / math.tau
    assert message.position[0] == pytest.approx(math.floor(turns * TICKS) / TICKS * math.tau)
    assert message.velocity[0] == pytest.approx(SPEED / RADIUS, rel=1e-3)
    assert not message.effort


def test_hitched(messages: dict[str, Any]) -> None:
    assert messages["/s/hitched"].data


def test_odometry_of_an_omni_drive(ros: Any) -> None:
    """The wheels limit (0.5, 0.5, 0) to the half: that at the front right would have 1 m/s."""
    truth = ros.ready_topic("/o/odometry/ground_truth", Odometry)
    ros.publisher("/o/cmd_vel", Twist).publish(Twist(Vector3(1.0, 1.0, 0), Vector3()))

    def moving() -> Any:
        message = truth.next()
        return message if message.twist.twist.linear.y else None

    message = ros.step_until("a moving robot", moving, 0.05)
    velocity = message.twist.twist
    expected = (0.5, 0.5, 0)
    found = (velocity.linear.x, velocity.linear.y, velocity.angular.z)
    assert found == pytest.approx(expected, abs=1e-5)
    assert (message.header.frame_id, message.child_frame_id) == ("map", "o_base")
