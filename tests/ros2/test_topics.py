"""The table of topics: types, frames, rates and quality of service of a running node."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import topic_table
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage
from topic_table import TABLE, Row

from flatland.ros2.message_types import message_class

DURATION = 2.0  # s
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world(
        topic_table.WORLD, properties=topic_table.PROPERTIES, sensors=topic_table.ROBOT
    )


@pytest.fixture(scope="module")
def server(module_ros: Any, module_launcher: Any, world: Path) -> Any:
    return module_launcher.server(module_ros, world, lockstep=True, seed=1)


@pytest.mark.usefixtures("server")
@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_topic(ros: Any, row: Row) -> None:
    message_type = message_class(row.type)
    profile = {"state": LATCHED, "reliable": QoSProfile(depth=1000)}.get(row.delivery, BEST_EFFORT)
    topic = ros.topic(row.name, message_type, profile)
    [publisher] = ros.node.get_publishers_info_by_topic(row.name)
    package, name = row.type.replace("flatland/", "flatland_msgs/").split("/")
    assert publisher.topic_type == f"{package}/msg/{name}"
    offered = publisher.qos_profile
    assert offered.reliability == profile.reliability
    assert offered.durability == profile.durability
    if row.delivery == "state":
        message = topic.next()  # of a late subscriber
    if row.rate is not None and row.delivery != "reliable":
        # One after the other, because a subscriber need not receive all messages of a burst.
        ros.wait_until_ready(row.name)
        topic.drop()
        for _ in range(3):
            ros.step(1 / row.rate)
            message = topic.next()
    elif row.rate is not None:
        ros.wait_until_ready(row.name)
        topic.drop()
        ros.step(DURATION)
        for _ in range(round(DURATION * row.rate)):
            message = topic.next()
        assert len(topic.drop()) <= 1
    if row.frame is not None:
        assert message.header.frame_id == row.frame


@pytest.mark.usefixtures("server")
def test_late_subscribers_receive_the_map_and_the_frames_of_sensors(ros: Any) -> None:
    ros.step(0.1)
    for _ in range(2):
        grid = ros.topic("/map", OccupancyGrid, LATCHED).next()
        assert len(grid.data) == grid.info.width * grid.info.height > 0
        transforms = ros.topic("/tf", TFMessage, 1000)
        ros.wait_until_ready("/tf")
        ros.step(0.1)
        found: dict[str, str] = {}
        while found.keys() < {"base", "laser", "imu", "gps", "sonar"}:
            found |= {
                each.child_frame_id: each.header.frame_id for each in transforms.next().transforms
            }
        assert found.pop("base") == "odom"
        assert set(found.values()) == {"base"}
        ros.close()


def test_sensors_are_reliable_on_request(ros: Any, launcher: Any, world: Path) -> None:
    launcher.server(ros, world, "-r", "__ns:=/reliable", reliable_sensors=True)
    # As the clients of the ports of the reference to ROS 2.
    assert len(ros.topic("/reliable/scan", LaserScan, 1).next().ranges) == 7


@pytest.mark.parametrize(
    ("stamped", "command_type"), [(False, Twist), (True, TwistStamped)], ids=["Twist", "stamped"]
)
def test_velocity_commands(
    ros: Any, launcher: Any, world: Path, stamped: bool, command_type: type[Any]
) -> None:
    launcher.server(ros, world, "-r", "__ns:=/driven", enable_stamped_cmd_vel=stamped)
    odometry = ros.topic("/driven/odometry/filtered", Odometry)
    publisher = ros.publisher("/driven/cmd_vel", command_type)
    command = command_type()
    (command.twist if stamped else command).linear.x = 0.25
    publisher.publish(command)
    odometry.until(lambda message: message.twist.twist.linear.x == pytest.approx(0.25))


def test_a_killed_client_and_its_successor(ros: Any, launcher: Any, world: Path) -> None:
    launcher.server(ros, world, "-r", "__ns:=/survivor")
    script = (
        "import rclpy; from rclpy.qos import qos_profile_sensor_data as sensor\n"
        "from sensor_msgs.msg import LaserScan; rclpy.init()\n"
        "node = rclpy.create_node('listener')\n"
        "node.create_subscription(LaserScan, '/survivor/scan', lambda m: print('scan'), sensor)\n"
        "rclpy.spin(node)\n"
    )
    for _ in range(2):
        client = launcher.program(sys.executable, "-c", script)
        client.wait_for_line("scan")
        client.kill()
    ros.wait_until_ready(namespace="/survivor")
    assert len(ros.topic("/survivor/scan", LaserScan, BEST_EFFORT).next().ranges) == 7
