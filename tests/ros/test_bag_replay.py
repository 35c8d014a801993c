"""A bag of `flatland run` is replayed by rosbag."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from flatland_command import main
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage


def test_a_replayed_bag_publishes_time_scans_and_transforms(
    launcher: Any, ros: Any, write_world: Callable[..., Path], tmp_path: Path
) -> None:
    """Topics with their types, and a clock that does not run ahead of the stamps."""
    bag = tmp_path / "a.bag"
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    drive = ["--command", "/cmd_vel={linear: {x: 0.5}}"]
    assert main("run", str(world), "--duration", "4", "--bag", str(bag), *drive) == 0
    player = launcher.program(
        "rosbag", "play", "--clock", "-r", "4", "--wait-for-subscribers", "--topics",
        "/scan", "/tf", "/odometry/ground_truth", "--bags", str(bag),
    )  # fmt: skip
    scans = ros.topic("/scan", LaserScan)
    odometry = ros.topic("/odometry/ground_truth", Odometry)
    transforms = ros.topic("/tf", TFMessage)
    clock = ros.topic("/clock", Clock)
    last = scans.until(lambda scan: scan.header.stamp.to_sec() > 3.0)
    assert len(last.ranges) == 7
    odometry.until(lambda message: message.pose.pose.position.x > 1.4)
    message = transforms.next()
    assert message.transforms[0].header.frame_id == "odom"
    assert clock.until(lambda time: time.clock.to_sec() > 2.0).clock.to_sec() < 5.0
    assert player.wait() == 0, player.output
