"""Topics of a running node: types, rates, frames and contents."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, LaserScan, NavSatFix
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from flatland.msg import Collisions

ROBOT = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}
  - {name: mast, pose: [0.1, 0, 0.5], footprints: []}
joints:
  - {name: j, type: weld, angle: 0.5,
     bodies: [{name: base, anchor: [0.1, 0]}, {name: mast, anchor: [0, 0]}]}
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 40, odom_pose_noise: [0.01, 0.02, 0.03]}
  - {type: Laser, name: front, body: base, range: 20, update_rate: 10, origin: [0.1, 0, 0],
     angle: {min: -1.5, max: 1.5, increment: 0.5}}
  - {type: Laser, name: roof, body: base, range: 3, update_rate: 10, topic: roof, frame: /up,
     upside_down: true, angle: {min: -1, max: 1, increment: 1}}
  - {type: ModelTfPublisher, name: tf, publish_tf_world: true, update_rate: 20}
  - {type: Bumper, name: bumper, update_rate: 10}
  - {type: BoolSensor, name: switch, update_rate: 10, topic: /switch}
  - {type: Gps, name: gps, body: base, update_rate: 10, ref_lat: 43.5, ref_lon: -80.5}
  - {type: Imu, name: imu, body: base, update_rate: 10}
"""
MODELS = """
  - {name: robot, model: robot.model.yaml, namespace: r1, pose: [1, 2, 0]}
  - {name: wheel, model: tricycle.model.yaml, pose: [-2, -2, 0]}
"""
TRICYCLE = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}
  - {name: front, footprints: []}
  - {name: left, pose: [-0.4, 0.2, 0], footprints: []}
  - {name: right, pose: [-0.4, -0.2, 0], footprints: []}
joints:
  - {name: f, type: revolute, bodies: [{name: base, anchor: [0, 0]}, {name: front, anchor: [0, 0]}]}
  - {name: l, type: weld, bodies: [{name: base, anchor: [-0.4, 0.2]}, {name: left, anchor: [0, 0]}]}
  - {name: r, type: weld,
     bodies: [{name: base, anchor: [-0.4, -0.2]}, {name: right, anchor: [0, 0]}]}
plugins:
  - {type: TricycleDrive, name: drive, body: base, front_wheel_joint: f, rear_left_wheel_joint: l,
     rear_right_wheel_joint: r, pub_rate: 20}
"""
TOPICS = {
    "/clock": "rosgraph_msgs/Clock",
    "/tf": "tf2_msgs/TFMessage",
    "/r1/scan": "sensor_msgs/LaserScan",
    "/r1/roof": "sensor_msgs/LaserScan",
    "/r1/odometry/filtered": "nav_msgs/Odometry",
    "/r1/odometry/ground_truth": "nav_msgs/Odometry",
    "/r1/twist": "geometry_msgs/TwistWithCovarianceStamped",
    "/r1/collisions": "flatland/Collisions",
    "/switch": "std_msgs/Bool",
    "/r1/gps/fix": "sensor_msgs/NavSatFix",
    "/r1/imu/filtered": "sensor_msgs/Imu",
    "/r1/imu/ground_truth": "sensor_msgs/Imu",
    "/odometry/filtered": "nav_msgs/Odometry",
    "/odometry/ground_truth": "nav_msgs/Odometry",
    "/model_states": "flatland/ModelStates",
    "/rosout": "rosgraph_msgs/Log",
}
COMMANDS = {"/r1/cmd_vel": "geometry_msgs/Twist", "/cmd_vel": "geometry_msgs/Twist"}
SERVICES = {
    "/spawn_model",
    "/delete_model",
    "/move_model",
    "/spawn_models",
    "/delete_models",
    "/move_models",
    "/get_model_states",
    "/set_appearance",
    "/set_layer_map",
    "/step_world",
    "/reset_world",
    "/set_rate",
    "/pause",
    "/resume",
    "/toggle_pause",
    "/flatland_server/get_loggers",
    "/flatland_server/set_logger_level",
}


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """One server for all tests of this file."""
    world = write_world(MODELS, robot=ROBOT, tricycle=TRICYCLE)
    return module_launcher.server(world, seed=1, update_rate=400)


def stamps(messages: list[Any]) -> list[int]:
    return [message.header.stamp.to_nsec() for message in messages]


def test_node_registers_exactly_the_topics_and_services_of_its_world(ros: Any) -> None:
    registered = ros.registered()
    assert registered["publishers"] == set(TOPICS)
    assert registered["subscribers"] == set(COMMANDS)
    assert registered["services"] == SERVICES
    types = ros.types()
    expected = {**TOPICS, **COMMANDS}
    assert {name: types.get(name) for name in expected} == expected


def test_clock_advances_by_whole_steps_from_zero(ros: Any) -> None:
    times = [message.clock.to_nsec() for message in ros.topic("/clock", Clock).take(50)]
    steps = [after - before for before, after in itertools.pairwise(times)]
    # A new subscriber may receive the current time twice. A slow reader may miss messages; the
    # others are ordered multiples of the step size.
    assert steps[0] >= 0
    assert all(step > 0 and step % 5_000_000 == 0 for step in steps[1:])
    assert 5_000_000 in steps
    assert times[0] % 5_000_000 == 0


@pytest.mark.parametrize(
    ("topic", "message_type", "period"),
    [
        ("/r1/scan", LaserScan, 0.1),
        ("/r1/odometry/filtered", Odometry, 0.025),
        ("/r1/odometry/ground_truth", Odometry, 0.025),
        ("/r1/twist", TwistWithCovarianceStamped, 0.025),
        ("/r1/gps/fix", NavSatFix, 0.1),
        ("/r1/imu/filtered", Imu, 0.1),
        ("/r1/collisions", Collisions, 0.1),
        ("/odometry/filtered", Odometry, 0.05),
    ],
)
def test_rates_are_exact_in_simulated_time(
    ros: Any, topic: str, message_type: type[Any], period: float
) -> None:
    times = stamps(ros.topic(topic, message_type).take(8))
    steps = [after - before for before, after in itertools.pairwise(times)]
    assert steps == [round(period * 1e9)] * 7


def test_topics_of_plugins_are_not_latched(ros: Any) -> None:
    scan = ros.topic("/r1/scan", LaserScan).next()
    assert scan._connection_header["latching"] == "0"
    assert scan._connection_header["callerid"] == "/flatland_server"


def test_all_fields_of_a_scan(ros: Any) -> None:
    scan = ros.topic("/r1/scan", LaserScan).next()
    assert scan.header.frame_id == "r1_front"
    assert scan.header.stamp.to_nsec() % 100_000_000 == 0
    for field, value in {
        "angle_min": -1.5,
        "angle_max": 1.5,
        "angle_increment": 0.5,
        "time_increment": 0,
        "scan_time": 0,
        "range_min": 0,
        "range_max": 20,
    }.items():
        assert getattr(scan, field) == pytest.approx(value, abs=1e-6), field
    # The sensor is at (1.1, 2) with yaw 0; the walls are at x = 5 and y = ±5.
    expected = []
    for i in range(7):
        angle = -1.5 + 0.5 * i
        to_y = ((5 if angle > 0 else -5) - 2) / math.sin(angle) if angle else math.inf
        expected.append(min(3.9 / math.cos(angle), to_y))
    assert scan.ranges == pytest.approx(expected, abs=1e-4)
    assert list(scan.intensities) == []


def test_scan_without_a_hit_is_nan(ros: Any) -> None:
    scan = ros.topic("/r1/roof", LaserScan).next()
    assert scan.header.frame_id == "up"
    # Upside down, so that the first beam, at -1, points to the left; the wall there is
    # 3 m / sin(1) away, out of range.
    assert [math.isnan(value) for value in scan.ranges] == [True] * 3


def test_pose_twist_and_covariances_of_odometry(ros: Any) -> None:
    truth = ros.topic("/r1/odometry/ground_truth", Odometry).next()
    assert (truth.header.frame_id, truth.child_frame_id) == ("map", "r1_base")
    position, rotation = truth.pose.pose.position, truth.pose.pose.orientation
    assert (position.x, position.y, position.z) == pytest.approx((1, 2, 0), abs=1e-5)
    assert (rotation.x, rotation.y, rotation.z, rotation.w) == pytest.approx((0, 0, 0, 1), abs=1e-5)
    assert list(truth.pose.covariance) == [0.0] * 36

    odometry = ros.topic("/r1/odometry/filtered", Odometry).next()
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "r1_base")
    expected = [0.0] * 36
    expected[0], expected[7], expected[35] = 0.01, 0.02, 0.03
    assert list(odometry.pose.covariance) == expected
    noisy = odometry.pose.pose.position
    assert (noisy.x, noisy.y) != (1, 2)


def test_fields_of_gps_imu_switch_and_bumper(ros: Any) -> None:
    fix = ros.topic("/r1/gps/fix", NavSatFix).next()
    assert fix.header.frame_id == "r1_gps"
    assert fix.latitude == pytest.approx(43.5 + 2 / 111_100, abs=1e-6)
    assert fix.longitude == pytest.approx(-80.5 + 1 / 80_800, abs=1e-6)
    imu = ros.topic("/r1/imu/filtered", Imu).next()
    assert imu.header.frame_id == "r1_imu"
    assert imu.orientation.w == pytest.approx(1, abs=1e-5)
    assert ros.topic("/switch", Bool).next().data is False
    collisions = ros.topic("/r1/collisions", Collisions).next()
    assert (collisions.header.frame_id, collisions.collisions) == ("map", [])


def test_all_transforms_of_a_step_are_in_one_message(ros: Any) -> None:
    def pairs(message: TFMessage) -> set[tuple[str, str]]:
        return {(each.header.frame_id, each.child_frame_id) for each in message.transforms}

    tf = ros.topic("/tf", TFMessage)
    full = tf.until(lambda message: ("r1_base", "r1_front") in pairs(message))
    # At multiples of 0.1 s the lasers, the drive and the model publisher are due together.
    assert pairs(full) >= {
        ("odom", "r1_base"),
        ("r1_base", "r1_front"),
        ("r1_base", "up"),
        ("r1_base", "r1_mast"),
        ("map", "r1_base"),
        ("r1_base", "r1_gps"),
    }
    assert len({each.header.stamp.to_nsec() for each in full.transforms}) == 1
    by_child = {each.child_frame_id: each.transform for each in full.transforms}
    front, up = by_child["r1_front"], by_child["up"]
    assert (front.translation.x, front.translation.y) == pytest.approx((0.1, 0))
    assert (up.rotation.x, up.rotation.y, up.rotation.z, up.rotation.w) == pytest.approx(
        (1, 0, 0, 0), abs=1e-9
    )
    mast = by_child["r1_mast"]
    assert mast.rotation.z == pytest.approx(math.sin(0.25), abs=1e-4)


def test_node_does_not_subscribe_to_its_own_clock(ros: Any) -> None:
    assert "/clock" not in ros.registered()["subscribers"]


def test_ros_time_of_the_node_is_the_simulated_time(ros: Any, server: Any, eventually: Any) -> None:
    clock = ros.topic("/clock", Clock)
    ros.log_everything()
    before = clock.next().clock.to_sec()
    seen = server.output.count("cycle use")
    eventually("a report", lambda: server.output.count("cycle use") > seen)
    clock.drop()
    after = clock.next().clock.to_sec()
    # The log lines of rospy contain the wall time and the ROS time.
    report = [line for line in server.output.splitlines() if "cycle use" in line][seen]
    match = re.match(r"\[DEBUG\] \[[\d.]+, ([\d.]+)\]: ", report)
    assert match is not None, report
    assert before < float(match[1]) <= after


def test_use_of_cycles_is_logged_at_debug_level(ros: Any, server: Any) -> None:
    ros.log_everything()
    line = server.wait_for_line("cycle use").string
    assert line.startswith("[DEBUG]")
    assert "min " in line
    assert "mean " in line
    assert "real-time factor: target 2.00, actual " in line
