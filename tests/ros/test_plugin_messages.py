"""Messages of built-in plugins: topics, types, rates, stamps and frames.

The contents of all messages are tested in `tests/unit/plugins`, their conversion in `adapters`.

All tests share one server, in lockstep, and one recording, in which the robot `r1` and the tricycle
`t1` drive in circles, and `p1` pushes against a wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable
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
  - {{type: DiffDrive, name: drive, body: base, odom_frame_id: here, ground_truth_frame_id: world}}
  - {{type: Laser, name: front, body: base, range: 20, update_rate: 25, origin: [0.1, 0.05, 0.2],
     angle: {{min: 0.5, max: -0.5, increment: -0.5}}, upside_down: true}}
  - {{type: ModelTfPublisher, name: tf, publish_tf_world: true, update_rate: 40, exclude: [flag]}}
  - {{type: Gps, name: gps, body: base, origin: [0.3, 0, 0]}}
  - {{type: Imu, name: imu, body: base, update_rate: 20}}
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
     rear_right_wheel_joint: r, pub_rate: 50}}
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
MODELS = """
  - {name: robot, model: robot.model.yaml, namespace: r1, pose: [1, 2, 0.3]}
  - {name: wheels, model: tricycle.model.yaml, namespace: t1, pose: [-2.5, -2, 0]}
  - {name: pusher, model: pusher.model.yaml, namespace: p1, pose: [4.5, 0, 0]}
  - {name: plate, model: plate.model.yaml, namespace: s1, pose: [-2, 2, 0]}
  - {name: post, model: post.model.yaml, pose: [-2, 3, 0]}
  - {name: guest, model: ball.model.yaml, pose: [-4, 4, 0]}
  - {name: door, model: door.model.yaml, namespace: d1, pose: [2, -4, 0]}
"""

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
        robot=ROBOT,
        tricycle=TRICYCLE,
        pusher=PUSHER,
        plate=PLATE,
        post=POST,
        door=DOOR,
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
        assert not scan.intensities  # without a layer `reflectance`


def distance_to_wall(x: float, y: float, angle: float) -> float:
    c, s = math.cos(angle), math.sin(angle)
    return min((math.copysign(5, c) - x) / c, (math.copysign(5, s) - y) / s)


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
