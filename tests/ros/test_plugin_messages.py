"""Topics, services and transforms of a world with most of the built-in plugins.

The contents of all messages are tested in `tests/unit/plugins`, their conversion in `adapters`,
rates and frames in `test_topic_table.py`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tf2_msgs.msg import TFMessage

STEP = 5_000_000  # ns
LENGTH = 1_000_000_000  # ns of simulated time in which transforms are received

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
PLATE = """
bodies:
  - {name: plate, footprints: [{type: circle, radius: 0.3, density: 1, sensor: true}]}
  - {name: arm, pose: [0, 1, 0],
     footprints: [{type: circle, radius: 0.3, density: 1, sensor: true}]}
plugins:
  - {type: BoolSensor, name: switch, update_rate: 20}
  - {type: BoolSensor, name: other, update_rate: 20, topic: arm, body: arm}
"""
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
  - {name: guest, model: ball.model.yaml, pose: [-4, 4, 0]}
  - {name: door, model: door.model.yaml, namespace: d1, pose: [2, -4, 0]}
"""

# Type of each topic.
TOPICS = {
    "/r1/odometry/ground_truth": "nav_msgs/Odometry",
    "/r1/odometry/filtered": "nav_msgs/Odometry",
    "/r1/twist": "geometry_msgs/TwistWithCovarianceStamped",
    "/r1/scan": "sensor_msgs/LaserScan",
    "/r1/gps/fix": "sensor_msgs/NavSatFix",
    "/r1/imu/filtered": "sensor_msgs/Imu",
    "/r1/imu/ground_truth": "sensor_msgs/Imu",
    "/t1/odometry/ground_truth": "nav_msgs/Odometry",
    "/t1/odometry/filtered": "nav_msgs/Odometry",
    "/p1/collisions": "flatland/Collisions",
    "/p1/calm": "flatland/Collisions",
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


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """One server for all tests of this file."""
    world = write_world(
        MODELS,
        robot=ROBOT,
        tricycle=TRICYCLE,
        pusher=PUSHER,
        plate=PLATE,
        door=DOOR,
    )
    return module_launcher.server(world, seed=7, lockstep=True)


@pytest.fixture(scope="module")
def transforms(module_ros: Any, server: Any) -> list[TFMessage]:
    """All messages on `/tf` of one interval of simulated time, in lockstep."""
    del server
    topic = module_ros.ready_topic("/tf", TFMessage)
    end = module_ros.step(0.1) + LENGTH
    while module_ros.step(0.1) <= end:
        pass
    messages: list[TFMessage] = []
    while not messages or messages[-1].transforms[0].header.stamp.to_nsec() < end:
        messages.append(topic.next())
    return messages


def test_node_registers_exactly_the_topics_and_services_of_its_world(ros: Any) -> None:
    registered = ros.registered()
    assert registered == {
        "publishers": set(TOPICS),
        "subscribers": set(COMMANDS),
        "services": SERVICES,
    }
    types = ros.types()
    expected = {**TOPICS, **COMMANDS}
    assert {name: types.get(name) for name in expected} == expected


def test_ros_time_of_the_node_is_the_simulated_time(ros: Any, server: Any) -> None:
    now = ros.step() / 1e9
    assert ros.spawn("ball.model.yaml", "here", pose=(-4.0, 4.0, 0.0)).success
    # The log lines of rospy contain the wall time and the ROS time.
    line = server.wait_for_line(r'\[WARN\] \[[\d.]+, ([\d.]+)\]: .*"here".* overlaps')
    assert float(line[1]) == pytest.approx(now, abs=1e-6)
    assert ros.delete("here").success


def test_all_transforms_of_a_step_are_in_one_message(transforms: list[TFMessage]) -> None:
    together = max(transforms, key=lambda message: len(message.transforms))
    pairs = [(each.header.frame_id, each.child_frame_id) for each in together.transforms]
    # All but the one of the IMU, which measures after the step, and is sent with the step before.
    assert len(pairs) == len(TRANSFORMS) - 1
    assert set(pairs) == set(TRANSFORMS) - {("r1_base", "r1_imu")}
    assert len({each.header.stamp.to_nsec() for each in together.transforms}) == 1


def test_rates_of_transforms(transforms: list[TFMessage]) -> None:
    """There are none of the tricycle, of excluded bodies, or of plugins that do not send any."""
    times = defaultdict(list)
    for message in transforms:
        for each in message.transforms:
            pair = (each.header.frame_id, each.child_frame_id)
            times[pair].append(each.header.stamp.to_nsec())
    assert times.keys() == TRANSFORMS.keys()
    for pair, period in TRANSFORMS.items():
        found = times[pair]
        assert found == list(range(found[0], found[-1] + 1, period)), pair
        assert found[0] % period == 0
        assert len(found) >= LENGTH // period
