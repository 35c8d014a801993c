"""Messages of each built-in plugin: fields, frames, stamps, rates and covariances.

All tests share one server, in lockstep, and one recording, in which the robot `r1` and the tricycle
`t1` drive in circles, and `p1` pushes against a wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist, TwistWithCovarianceStamped, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, LaserScan, NavSatFix
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage
from waiting import wait_until

from flatland.msg import Collisions
from flatland.srv import GetModelStates

STEP = 5_000_000  # ns
LENGTH = 1_500_000_000  # ns of simulated time that are recorded
REF_LAT, REF_LON = 43.5, -80.5

LIGHT = "[{type: circle, radius: 0.01, density: 1, layers: []}]"
ROBOT = f"""
bodies:
  - {{name: base, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}
  - {{name: mast, pose: [0.1, 0, 0.5], footprints: {LIGHT}}}
  - {{name: flag, footprints: {LIGHT}}}
joints:
  - {{name: m, type: weld, angle: 0.5,
     bodies: [{{name: base, anchor: [0.1, 0]}}, {{name: mast, anchor: [0, 0]}}]}}
  - {{name: f, type: weld,
     bodies: [{{name: base, anchor: [0, 0]}}, {{name: flag, anchor: [0, 0]}}]}}
plugins:
  - {{type: DiffDrive, name: drive, body: base, odom_frame_id: here, ground_truth_frame_id: world,
     odom_pose_noise: [0.01, 0.02, 0.03], odom_twist_noise: [0.04, 0.05, 0.06],
     odom_pose_covariance: {list(range(36))}}}
  - {{type: Laser, name: front, body: base, range: 20, update_rate: 25, origin: [0.1, 0.05, 0.2],
     angle: {{min: 0.5, max: -0.5, increment: -0.5}}, upside_down: true}}
  - {{type: ModelTfPublisher, name: tf, publish_tf_world: true, update_rate: 40, exclude: [flag]}}
  - {{type: Gps, name: gps, body: base, ref_lat: {REF_LAT}, ref_lon: {REF_LON},
     origin: [0.3, 0, 0]}}
  - {{type: Imu, name: imu, body: base, update_rate: 20, orientation_noise: [0.1, 0.2, 0.3],
     angular_velocity_noise: [0.4, 0.5, 0.6], linear_acceleration_noise: [0.7, 0.8, 0.9],
     linear_acceleration_covariance: [1, 2, 3, 4, 5, 6, 7, 8, 9]}}
"""
TRICYCLE = f"""
bodies:
  - {{name: base, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}
  - {{name: front, footprints: {LIGHT}}}
  - {{name: left, pose: [-0.4, 0.2, 0], footprints: {LIGHT}}}
  - {{name: right, pose: [-0.4, -0.2, 0], footprints: {LIGHT}}}
joints:
  - {{name: f, type: revolute,
     bodies: [{{name: base, anchor: [0, 0]}}, {{name: front, anchor: [0, 0]}}]}}
  - {{name: l, type: weld,
     bodies: [{{name: base, anchor: [-0.4, 0.2]}}, {{name: left, anchor: [0, 0]}}]}}
  - {{name: r, type: weld,
     bodies: [{{name: base, anchor: [-0.4, -0.2]}}, {{name: right, anchor: [0, 0]}}]}}
plugins:
  - {{type: TricycleDrive, name: drive, body: base, front_wheel_joint: f, rear_left_wheel_joint: l,
     rear_right_wheel_joint: r, pub_rate: 50, odom_pose_noise: [1.0e-6, 1.0e-6, 1.0e-6],
     odom_twist_covariance: [1, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0,
                             0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 6]}}
"""
PUSHER = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 10}]}
  - {name: feeler, footprints: [{type: circle, radius: 0.3, density: 1.0e-6, sensor: true}]}
joints:
  - {name: f, type: weld,
     bodies: [{name: base, anchor: [0, 0]}, {name: feeler, anchor: [0, 0]}]}
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 0, enable_odom_tf_pub: false}
  - {type: Bumper, name: eager, update_rate: 10}
  - {type: Bumper, name: calm, update_rate: 10, publish_all_collisions: false, topic: calm,
     world_frame_id: world, exclude: [feeler]}
"""
# The arm touches a post permanently, which must not switch the sensor of the plate.
PLATE = """
bodies:
  - {name: plate, footprints: [{type: circle, radius: 0.3, density: 1, sensor: true}]}
  - {name: arm, pose: [0, 1, 0],
     footprints: [{type: circle, radius: 0.3, density: 1, sensor: true}]}
plugins:
  - {type: BoolSensor, name: switch, update_rate: 20}
  - {type: BoolSensor, name: other, update_rate: 20, topic: arm, body: arm}
"""
POST = "bodies: [{name: post, type: static, footprints: [{type: circle, radius: 0.1, density: 0}]}]"
DOOR = """
bodies:
  - {name: leaf, type: kinematic, footprints: [{type: circle, radius: 0.1, density: 0}]}
plugins:
  - {type: Tween, name: opener, body: leaf, delta: [0.5, 0, 0], duration: 0.1, mode: trigger,
     trigger_topic: open}
  - {type: ModelTfPublisher, name: tf, publish_tf_world: true}
"""
TOWER = """
bodies: [{name: base, type: static, footprints: []}]
plugins:
  - {type: Laser, name: lidar, body: base, range: 8.5, topic: mirror_scan, frame: /lidar,
     update_rate: 50, angle: {min: -1.5, max: 1.5, increment: 1.5}, no_hit: inf,
     broadcast_tf: false}
"""
MIRROR = """
bodies:
  - {name: glass, type: static,
     footprints: [{type: circle, radius: 0.1, density: 0, layers: [reflectance]}]}
"""
MODELS = """
  - {name: robot, model: robot.model.yaml, namespace: r1, pose: [1, 2, 0.3]}
  - {name: wheels, model: tricycle.model.yaml, namespace: t1, pose: [-2.5, -2, 0]}
  - {name: pusher, model: pusher.model.yaml, namespace: p1, pose: [4.5, 0, 0]}
  - {name: plate, model: plate.model.yaml, namespace: s1, pose: [-2, 2, 0]}
  - {name: post, model: post.model.yaml, pose: [-2, 3, 0]}
  - {name: guest, model: ball.model.yaml, pose: [-4, 4, 0]}
  - {name: door, model: door.model.yaml, namespace: d1, pose: [2, -4, 0]}
  - {name: tower, model: tower.model.yaml, pose: [-4, 0, 0]}
  - {name: mirror, model: mirror.model.yaml, pose: [-3, 0, 0]}
"""
LAYERS = "[{name: 2d, map: map.yaml}, {name: reflectance}]"

# Type and period in simulated time [ns] by topic.
RECORDED: dict[str, tuple[type[Any], int]] = {
    "/r1/odometry/ground_truth": (Odometry, STEP),
    "/r1/odometry/filtered": (Odometry, STEP),
    "/r1/twist": (TwistWithCovarianceStamped, STEP),
    "/r1/scan": (LaserScan, 40_000_000),
    "/r1/gps/fix": (NavSatFix, 100_000_000),
    "/r1/imu/filtered": (Imu, 50_000_000),
    "/r1/imu/ground_truth": (Imu, 50_000_000),
    "/t1/odometry/ground_truth": (Odometry, 20_000_000),
    "/t1/odometry/filtered": (Odometry, 20_000_000),
    "/p1/collisions": (Collisions, STEP),
    "/p1/calm": (Collisions, 100_000_000),
    "/mirror_scan": (LaserScan, 20_000_000),
}
# Types of the topics that are not recorded.
OTHER_TOPICS = {
    "/clock": "rosgraph_msgs/Clock",
    "/tf": "tf2_msgs/TFMessage",
    "/p1/odometry/ground_truth": "nav_msgs/Odometry",
    "/p1/odometry/filtered": "nav_msgs/Odometry",
    "/p1/twist": "geometry_msgs/TwistWithCovarianceStamped",
    "/s1/bool_sensor": "std_msgs/Bool",
    "/s1/arm": "std_msgs/Bool",
    "/model_states": "flatland/ModelStates",
    "/rosout": "rosgraph_msgs/Log",
}
COMMANDS = {
    "/r1/cmd_vel": "geometry_msgs/Twist",
    "/t1/cmd_vel": "geometry_msgs/Twist",
    "/p1/cmd_vel": "geometry_msgs/Twist",
    "/d1/open": "std_msgs/Bool",
}
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
    "/wait_until_ready",
    "/pause",
    "/resume",
    "/toggle_pause",
    "/flatland_server/get_loggers",
    "/flatland_server/set_logger_level",
}
# Period in simulated time [ns] by parent and child.
TRANSFORMS = {
    ("here", "r1_base"): STEP,
    ("r1_base", "r1_front"): 40_000_000,
    ("r1_base", "r1_mast"): 25_000_000,
    ("map", "r1_base"): 25_000_000,
    ("r1_base", "r1_gps"): 100_000_000,
    ("r1_base", "r1_imu"): 50_000_000,
    ("map", "d1_leaf"): STEP,
}
SPEED, TURN = 0.2, 0.5
WHEEL_SPEED, STEERING = 0.3, 0.4
PUSH = 0.5

Stamped = dict[int, Any]


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """One server for all tests of this file."""
    world = write_world(
        MODELS,
        layers=LAYERS,
        robot=ROBOT,
        tricycle=TRICYCLE,
        pusher=PUSHER,
        plate=PLATE,
        post=POST,
        door=DOOR,
        tower=TOWER,
        mirror=MIRROR,
    )
    return module_launcher.server(world, seed=7, lockstep=True)


def stamp(message: Any) -> int:
    if isinstance(message, TFMessage):
        message = message.transforms[0]
    nanoseconds: int = message.header.stamp.to_nsec()
    return nanoseconds


def drive(ros: Any, topic: str, linear: float, angular: float) -> None:
    ros.publisher(topic, Twist).publish(Twist(Vector3(linear, 0, 0), Vector3(0, 0, angular)))


def is_driving(ros: Any) -> bool:
    """Makes some steps, and returns whether all commands have arrived and `p1` is at the wall."""
    ros.step(0.1)
    states = ros.call("/get_model_states", GetModelStates, ["robot", "wheels", "pusher"]).states
    robot, wheels, pusher = zip(states.pose, states.twist, strict=True)
    return bool(robot[1].angular.z and wheels[1].angular.z and pusher[0].x > 4.79)


@pytest.fixture(scope="module")
def recording(module_ros: Any, server: Any) -> dict[str, Stamped]:
    """All messages of one interval of simulated time, by topic and stamp."""
    ros = module_ros
    topics = {name: ros.topic(name, kind) for name, (kind, _) in RECORDED.items()}
    topics["/tf"] = ros.topic("/tf", TFMessage)
    ros.wait_until_ready(*topics)
    drive(ros, "/r1/cmd_vel", SPEED, TURN)
    drive(ros, "/t1/cmd_vel", WHEEL_SPEED, STEERING)
    drive(ros, "/p1/cmd_vel", PUSH, 0)
    wait_until("three robots that drive", lambda: is_driving(ros))
    start = -(-ros.step(0.2) // 100_000_000) * 100_000_000 + 100_000_000
    end = start + LENGTH
    while ros.step(0.1) <= end + 100_000_000:
        pass
    recorded: dict[str, Stamped] = {}
    for name, topic in topics.items():
        messages = [topic.until(lambda message: stamp(message) >= start)]
        while stamp(messages[-1]) < end:
            messages.append(topic.next())
        recorded[name] = {stamp(message): message for message in messages}
        topic.close()
    return recorded


def yaw(rotation: Any) -> float:
    assert (rotation.x, rotation.y) == (0, 0)
    return 2 * math.atan2(rotation.z, rotation.w)


def pose(message: Odometry) -> tuple[float, float, float]:
    position = message.pose.pose.position
    assert position.z == 0
    return (position.x, position.y, yaw(message.pose.pose.orientation))


def same_angle(value: float, expected: float, tolerance: float = 1e-9) -> bool:
    return abs(math.remainder(value - expected, math.tau)) <= tolerance


def variance(values: Iterable[float]) -> float:
    """Returns the variance of values whose expectation is 0."""
    squares = [value**2 for value in values]
    return sum(squares) / len(squares)


def assert_period(times: list[int], period: int) -> None:
    assert sorted(times) == list(range(min(times), max(times) + 1, period))
    assert all(time % period == 0 for time in times)
    assert len(times) >= LENGTH // period


# -- the node ---------------------------------------------------------------------------------


def test_node_registers_exactly_the_topics_and_services_of_its_world(ros: Any) -> None:
    topics = {**{name: kind._type for name, (kind, _) in RECORDED.items()}, **OTHER_TOPICS}
    registered = ros.registered()
    assert registered == {
        "publishers": set(topics),
        "subscribers": set(COMMANDS),
        "services": SERVICES,
    }
    types = ros.types()
    expected = {**topics, **COMMANDS}
    assert {name: types.get(name) for name in expected} == expected


def test_clock_is_published_in_each_step(ros: Any) -> None:
    clock = ros.ready_topic("/clock", Clock)
    start = clock.next().clock.to_nsec()  # A new subscriber receives the current time.
    ros.step(0.25)
    times = [message.clock.to_nsec() for message in clock.take(50)]
    assert times == [start + number * STEP for number in range(1, 51)]


def test_ros_time_of_the_node_is_the_simulated_time(ros: Any, server: Any) -> None:
    now = ros.step() / 1e9
    assert ros.spawn("ball.model.yaml", "here", pose=(-4.0, 4.0, 0.0)).success
    # The log lines of rospy contain the wall time and the ROS time.
    line = server.wait_for_line(r'\[WARN\] \[[\d.]+, ([\d.]+)\]: .*"here".* overlaps')
    assert float(line[1]) == pytest.approx(now, abs=1e-6)
    assert ros.delete("here").success


def test_all_transforms_of_a_step_are_in_one_message(recording: dict[str, Stamped]) -> None:
    together = max(recording["/tf"].values(), key=lambda message: len(message.transforms))
    pairs = [(each.header.frame_id, each.child_frame_id) for each in together.transforms]
    # All but the one of the IMU, which measures after the step, and is sent with the step before.
    assert len(pairs) == len(TRANSFORMS) - 1
    assert set(pairs) == set(TRANSFORMS) - {("r1_base", "r1_imu")}
    assert len({each.header.stamp.to_nsec() for each in together.transforms}) == 1


@pytest.mark.parametrize("topic", RECORDED)
def test_rate_type_and_latching(recording: dict[str, Stamped], topic: str) -> None:
    kind, period = RECORDED[topic]
    assert_period(list(recording[topic]), period)
    for message in recording[topic].values():
        header = message._connection_header
        assert (header["type"], header["latching"]) == (kind._type, "0")
        assert (header["md5sum"], header["topic"]) == (kind._md5sum, topic)


@pytest.mark.parametrize("pair", TRANSFORMS, ids="-".join)
def test_rate_of_transforms(recording: dict[str, Stamped], pair: tuple[str, str]) -> None:
    assert_period(list(transforms(recording, *pair)), TRANSFORMS[pair])


def test_no_other_transforms(recording: dict[str, Stamped]) -> None:
    # None of the tricycle, of excluded bodies, or of plugins that do not send transforms.
    sent = {
        (each.header.frame_id, each.child_frame_id)
        for message in recording["/tf"].values()
        for each in message.transforms
    }
    assert sent == set(TRANSFORMS)


def transforms(recording: dict[str, Stamped], parent: str, child: str) -> Stamped:
    return {
        each.header.stamp.to_nsec(): each.transform
        for message in recording["/tf"].values()
        for each in message.transforms
        if (each.header.frame_id, each.child_frame_id) == (parent, child)
    }


def together(first: Stamped, second: Stamped) -> list[tuple[Any, Any]]:
    """Returns the pairs with equal stamps of two recordings: most of the shorter one."""
    pairs = [(first[time], second[time]) for time in sorted(first.keys() & second.keys())]
    assert len(pairs) > 0.9 * min(len(first), len(second))
    return pairs


def is_constant(values: Iterable[Any]) -> bool:
    values = list(values)
    return all(value == values[0] for value in values)


# -- DiffDrive --------------------------------------------------------------------------------


def test_diff_drive_ground_truth(recording: dict[str, Stamped]) -> None:
    for truth in recording["/r1/odometry/ground_truth"].values():
        assert (truth.header.frame_id, truth.child_frame_id) == ("world", "r1_base")
        twist = truth.twist.twist
        # In the frame of the body (REP 105), although the robot has turned.
        assert (twist.linear.x, twist.angular.z) == pytest.approx((SPEED, TURN), abs=1e-6)
        assert twist.linear.y == pytest.approx(0, abs=1e-6)
        assert (twist.linear.z, twist.angular.x, twist.angular.y) == (0, 0, 0)
        assert not any(truth.pose.covariance)
        assert not any(truth.twist.covariance)


def test_diff_drive_pose_agrees_with_the_stamps(recording: dict[str, Stamped]) -> None:
    truths = recording["/r1/odometry/ground_truth"]
    first, last = min(truths), max(truths)
    (x0, y0, yaw0), (x1, y1, yaw1) = pose(truths[first]), pose(truths[last])
    turned = TURN * (last - first) * 1e-9
    assert same_angle(yaw1 - yaw0, turned, 1e-4)
    chord = 2 * SPEED / TURN * math.sin(turned / 2)
    assert math.hypot(x1 - x0, y1 - y0) == pytest.approx(chord, abs=1e-3)


def test_diff_drive_odometry_is_the_truth_with_noise(recording: dict[str, Stamped]) -> None:
    pairs = together(recording["/r1/odometry/filtered"], recording["/r1/odometry/ground_truth"])
    expected = [0.0] * 36
    expected[0], expected[7], expected[35] = 0.04, 0.05, 0.06
    errors: list[tuple[float, ...]] = []
    for odometry, truth in pairs:
        assert (odometry.header.frame_id, odometry.child_frame_id) == ("here", "r1_base")
        assert list(odometry.pose.covariance) == list(range(36))  # row by row, as configured
        assert list(odometry.twist.covariance) == expected  # from the noise
        noisy, exact = pose(odometry), pose(truth)
        got, true = odometry.twist.twist, truth.twist.twist
        errors.append(
            (
                noisy[0] - exact[0],
                noisy[1] - exact[1],
                math.remainder(noisy[2] - exact[2], math.tau),
                got.linear.x - true.linear.x,
                got.linear.y - true.linear.y,
                got.angular.z - true.angular.z,
            )
        )
    variances = [variance(column) for column in zip(*errors, strict=True)]
    assert variances == pytest.approx([0.01, 0.02, 0.03, 0.04, 0.05, 0.06], rel=0.4)


def test_diff_drive_transform_equals_the_noisy_odometry(recording: dict[str, Stamped]) -> None:
    sent = transforms(recording, "here", "r1_base")
    for transform, odometry in together(sent, recording["/r1/odometry/filtered"]):
        moved = transform.translation
        assert (moved.x, moved.y, moved.z) == (*pose(odometry)[:2], 0)
        assert transform.rotation == odometry.pose.pose.orientation


def test_diff_drive_twist_has_independent_noise(recording: dict[str, Stamped]) -> None:
    pairs = together(recording["/r1/twist"], recording["/r1/odometry/filtered"])
    forward, turn = [], []
    for measured, odometry in pairs:
        assert measured.header.frame_id == "r1_base"
        twist = measured.twist.twist
        assert (twist.linear.y, twist.linear.z, twist.angular.x, twist.angular.y) == (0, 0, 0, 0)
        assert measured.twist.covariance == odometry.twist.covariance
        assert twist.linear.x != odometry.twist.twist.linear.x
        forward.append(twist.linear.x - SPEED)
        turn.append(twist.angular.z - TURN)
    assert variance(forward) == pytest.approx(0.04, rel=0.4)
    assert variance(turn) == pytest.approx(0.06, rel=0.4)


# -- TricycleDrive ----------------------------------------------------------------------------


def test_tricycle_drive(recording: dict[str, Stamped], ros: Any) -> None:
    published = {name for name in ros.registered()["publishers"] if name.startswith("/t1/")}
    assert published == {"/t1/odometry/filtered", "/t1/odometry/ground_truth"}  # no twist topic
    truths, odometries = (
        recording[f"/t1/odometry/{name}"] for name in ("ground_truth", "filtered")
    )
    speed = WHEEL_SPEED * math.cos(STEERING)
    rate = WHEEL_SPEED * math.sin(STEERING) / 0.4
    for odometry, truth in together(odometries, truths):
        assert (truth.header.frame_id, truth.child_frame_id) == ("map", "t1_base")
        # Unlike the reference: not the frame of the ground truth.
        assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "t1_base")
        assert pose(odometry) == pytest.approx(pose(truth), abs=0.01)
        assert pose(odometry) != pose(truth)
        heading, twist = pose(truth)[2], truth.twist.twist
        # In the world frame: the rear centre moves along the heading, the origin rotates around it.
        c, s = math.cos(heading), math.sin(heading)
        expected = (c * speed - s * rate * 0.4, s * speed + c * rate * 0.4, rate)
        got = (twist.linear.x, twist.linear.y, twist.angular.z)
        # The pose is that after the step for which the velocity was set.
        assert got == pytest.approx(expected, abs=2 * rate * 0.005 * WHEEL_SPEED)
        assert odometry.twist.twist == twist
        assert not any(truth.pose.covariance)
        assert not any(truth.twist.covariance)
        diagonal = [odometry.twist.covariance[7 * i] for i in range(6)]
        assert diagonal == [1, 2, 3, 4, 5, 6]
        assert [odometry.pose.covariance[7 * i] for i in range(6)] == [1e-6, 1e-6, 0, 0, 0, 1e-6]


# -- Laser ------------------------------------------------------------------------------------


def test_laser_scan_agrees_with_its_stamp(recording: dict[str, Stamped]) -> None:
    for scan, truth in together(recording["/r1/scan"], recording["/r1/odometry/ground_truth"]):
        assert scan.header.frame_id == "r1_front"
        got = (scan.angle_min, scan.angle_max, scan.angle_increment, scan.range_max)
        assert got == pytest.approx((0.5, -0.5, -0.5, 20))
        assert (scan.time_increment, scan.scan_time, scan.range_min) == (0, 0, 0)
        x, y, heading = pose(truth)
        c, s = math.cos(heading), math.sin(heading)
        x, y = x + 0.1 * c - 0.05 * s, y + 0.1 * s + 0.05 * c
        # Upside down, so that the first beam, at 0.5, points to the right.
        expected = [distance_to_wall(x, y, heading + 0.2 + angle) for angle in (-0.5, 0.0, 0.5)]
        assert list(scan.ranges) == pytest.approx(expected, abs=1e-4)
        assert list(scan.intensities) == [0, 0, 0]


def distance_to_wall(x: float, y: float, angle: float) -> float:
    c, s = math.cos(angle), math.sin(angle)
    return min((math.copysign(5, c) - x) / c, (math.copysign(5, s) - y) / s)


def test_laser_transform_contains_the_roll(recording: dict[str, Stamped]) -> None:
    sent = transforms(recording, "r1_base", "r1_front")
    assert is_constant(sent.values())
    transform = next(iter(sent.values()))
    moved, turned = transform.translation, transform.rotation
    assert (moved.x, moved.y, moved.z) == (0.1, 0.05, 0)
    got = (turned.x, turned.y, turned.z, turned.w)
    assert got == pytest.approx((math.cos(0.1), math.sin(0.1), 0, 0), abs=1e-9)


def test_laser_intensities_no_hit_and_global_frame(recording: dict[str, Stamped]) -> None:
    for scan in recording["/mirror_scan"].values():
        assert scan.header.frame_id == "lidar"
        assert scan.ranges[1] == pytest.approx(0.9, abs=1e-4)
        side = 5 / math.sin(1.5)
        assert (scan.ranges[0], scan.ranges[2]) == pytest.approx((side, side), abs=1e-3)
        assert list(scan.intensities) == [0, 255, 0]


# -- ModelTfPublisher -------------------------------------------------------------------------


def test_model_tf_publisher(recording: dict[str, Stamped]) -> None:
    for transform in transforms(recording, "r1_base", "r1_mast").values():
        moved = transform.translation
        assert (moved.x, moved.y, moved.z) == pytest.approx((0.1, 0, 0), abs=1e-3)
        assert same_angle(yaw(transform.rotation), 0.5, 1e-3)
    sent = transforms(recording, "map", "r1_base")
    for transform, truth in together(sent, recording["/r1/odometry/ground_truth"]):
        moved = transform.translation
        assert (moved.x, moved.y, yaw(transform.rotation)) == pytest.approx(pose(truth), abs=1e-9)


# -- Gps --------------------------------------------------------------------------------------


def test_gps_agrees_with_its_stamp(recording: dict[str, Stamped]) -> None:
    # Near the reference point, distances divided by the radii of curvature of WGS84.
    latitude = math.radians(REF_LAT)
    w = 1 - 0.0066943799831668 * math.sin(latitude) ** 2
    north_radius = 6378137 * (1 - 0.0066943799831668) / w**1.5
    east_radius = 6378137 / math.sqrt(w) * math.cos(latitude)
    for fix, truth in together(recording["/r1/gps/fix"], recording["/r1/odometry/ground_truth"]):
        assert fix.header.frame_id == "r1_gps"
        x, y, heading = pose(truth)
        x, y = x + 0.3 * math.cos(heading), y + 0.3 * math.sin(heading)
        assert fix.latitude == pytest.approx(REF_LAT + math.degrees(y / north_radius), abs=1e-9)
        assert fix.longitude == pytest.approx(REF_LON + math.degrees(x / east_radius), abs=1e-9)
        assert fix.altitude == 0
        assert (fix.status.status, fix.status.service) == (0, 1)  # a fix, by GPS
        assert (fix.position_covariance_type, any(fix.position_covariance)) == (0, False)
    for transform in transforms(recording, "r1_base", "r1_gps").values():
        moved = transform.translation
        assert (moved.x, moved.y, yaw(transform.rotation)) == (0.3, 0, 0)


# -- Imu --------------------------------------------------------------------------------------


def test_imu_ground_truth_agrees_with_its_stamp(recording: dict[str, Stamped]) -> None:
    interval = 0.05
    turned = TURN * interval
    # Mean acceleration in a circle to the left, in the frame of the pose after the last step; the
    # velocity is along the heading before that step.
    size, angle = 2 * SPEED * math.sin(turned / 2) / interval, turned / 2 + TURN * STEP * 1e-9
    expected = (size * math.sin(angle), size * math.cos(angle))
    truths = recording["/r1/imu/ground_truth"]
    for imu, truth in together(truths, recording["/r1/odometry/ground_truth"]):
        assert imu.header.frame_id == "r1_imu"
        # The state after the step that ends at the stamp.
        assert same_angle(yaw(imu.orientation), pose(truth)[2])
        rate, acceleration = imu.angular_velocity, imu.linear_acceleration
        assert (rate.x, rate.y) == (0, 0)
        assert rate.z == pytest.approx(TURN, abs=1e-4)
        assert (acceleration.x, acceleration.y) == pytest.approx(expected, abs=1e-4)
        assert acceleration.z == 0
        assert not any(imu.orientation_covariance)
        assert not any(imu.angular_velocity_covariance)
        assert not any(imu.linear_acceleration_covariance)


def test_imu_with_noise(recording: dict[str, Stamped]) -> None:
    pairs = together(recording["/r1/imu/filtered"], recording["/r1/imu/ground_truth"])
    errors: list[tuple[float, ...]] = []
    for imu, truth in pairs:
        assert imu.header.frame_id == "r1_imu"
        assert list(imu.orientation_covariance) == [0.1, 0, 0, 0, 0.2, 0, 0, 0, 0.3]
        assert list(imu.angular_velocity_covariance) == [0.4, 0, 0, 0, 0.5, 0, 0, 0, 0.6]
        assert list(imu.linear_acceleration_covariance) == list(range(1, 10))
        got, true = imu.linear_acceleration, truth.linear_acceleration
        assert (imu.angular_velocity.x, imu.angular_velocity.y, got.z) == (0, 0, 0)
        errors.append(
            (
                math.remainder(yaw(imu.orientation) - yaw(truth.orientation), math.tau),
                imu.angular_velocity.z - truth.angular_velocity.z,
                got.x - true.x,
                got.y - true.y,
            )
        )
    # About thirty messages do not determine a variance, but distinguish it from its square root.
    variances = [variance(column) for column in zip(*errors, strict=True)]
    for value, expected in zip(variances, [0.3, 0.6, 0.7, 0.8], strict=True):
        assert 0.3 * expected < value < 3 * expected


def test_imu_transform(recording: dict[str, Stamped]) -> None:
    sent = transforms(recording, "r1_base", "r1_imu")
    # The first transform in a message on /tf may be that of a laser, one step older than the
    # others, so that the recordings of the two topics may start and end with different steps.
    first, last = min(sent), max(sent)
    assert last - first > LENGTH / 2
    assert sent.keys() >= {
        time for time in recording["/r1/imu/ground_truth"] if first <= time <= last
    }
    for transform in sent.values():
        assert (transform.translation.x, transform.translation.y) == (0, 0)
        assert yaw(transform.rotation) == 0


# -- Bumper -----------------------------------------------------------------------------------


def test_bumper_reports_contacts_with_forces(recording: dict[str, Stamped]) -> None:
    # The drive restores the speed in each step, and the wall stops the body again.
    force = 10 * math.pi * 0.2**2 * PUSH / 0.005
    for message in recording["/p1/collisions"].values():
        assert message.header.frame_id == "map"
        by_body = {each.body_A: each for each in message.collisions}
        assert by_body.keys() == {"base", "feeler"}
        for each in message.collisions:
            assert (each.entity_A, each.entity_B, each.body_B) == ("pusher", "2d", "2d")
        feeler, base = by_body["feeler"], by_body["base"]
        assert (feeler.magnitude_forces, feeler.contact_positions) == ((), [])
        assert feeler.contact_normals == []
        assert list(base.magnitude_forces) == pytest.approx([force], rel=0.02)
        (position,), (normal,) = base.contact_positions, base.contact_normals
        assert (position.x, position.y) == pytest.approx((5, 0), abs=0.02)
        assert (normal.x, normal.y) == pytest.approx((1, 0), abs=1e-4)


def test_bumper_excludes_bodies(recording: dict[str, Stamped]) -> None:
    for message in recording["/p1/calm"].values():
        assert message.header.frame_id == "world"
        assert [each.body_A for each in message.collisions] == ["base"]


# -- responses to commands --------------------------------------------------------------------


def step_until(ros: Any, topic: Any, accept: Callable[[Any], bool]) -> Any:
    """Makes steps until a message is accepted, and returns it."""

    def accepted() -> list[Any]:
        ros.step(0.05)
        return [message for message in topic.rest(0) if accept(message)]

    return wait_until(f"a message on {topic.name}", accepted)[0]


def test_bool_sensor_switches(ros: Any) -> None:
    # Unlike the reference: the namespace occurs once, and the contact of the arm does not count.
    topic, arm = ros.topic("/s1/bool_sensor", Bool), ros.topic("/s1/arm", Bool)
    first = step_until(ros, topic, lambda message: not message.data)
    assert first._connection_header["latching"] == "0"
    step_until(ros, arm, lambda message: message.data)
    assert ros.move("guest", (-2.1, 1.9, 0)).success
    step_until(ros, topic, lambda message: message.data)
    assert ros.move("guest", (-4, 4, 0)).success
    step_until(ros, topic, lambda message: not message.data)
    arm.drop()
    ros.step(0.1)
    assert arm.next().data is True


def test_tween_moves_while_triggered(ros: Any) -> None:
    def position(message: TFMessage) -> float:
        by_child = {each.child_frame_id: each.transform for each in message.transforms}
        return by_child["d1_leaf"].translation.x if "d1_leaf" in by_child else math.nan

    tf = ros.topic("/tf", TFMessage)
    trigger = ros.publisher("/d1/open", Bool)
    step_until(ros, tf, lambda message: position(message) == pytest.approx(2.0, abs=1e-6))
    trigger.publish(Bool(True))
    step_until(ros, tf, lambda message: position(message) == pytest.approx(2.5, abs=1e-6))
    trigger.publish(Bool(False))
    step_until(ros, tf, lambda message: position(message) == pytest.approx(2.0, abs=1e-6))


def test_bumper_without_contacts_publishes_at_its_rate(ros: Any) -> None:
    drive(ros, "/p1/cmd_vel", 0, 0)
    topic = ros.topic("/p1/collisions", Collisions)
    states = (GetModelStates, ["pusher"])
    wait_until(
        "a pusher at rest",
        lambda: (
            ros.move("pusher", (3, 0, 0)).success
            and ros.step(0.1)
            and ros.call("/get_model_states", *states).states.twist[0].linear.x == 0.0
        ),
    )
    start = ros.step(0.2)  # The first messages may still be caused by contacts.
    ros.step(0.6)
    messages = [topic.until(lambda message: stamp(message) > start), *topic.take(4)]
    assert all(message.collisions == [] for message in messages)
    times = list(map(stamp, messages))
    assert times == list(range(times[0], times[0] + 500_000_000, 100_000_000))
