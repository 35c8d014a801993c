"""A tricycle for navigation: drifting odometry, its transform, twist commands, after_step."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tricycle
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

ROBOT = f"""
bodies:
{tricycle.BODIES}
joints:
{tricycle.JOINTS}
plugins:
  - {{{tricycle.DRIVE}, command: twist, enable_odom_tf_pub: true, pub_rate: 50, after_step: true,
     odom_drift: [0.05, 0.05, 0.05, 0.05], twist_in_local_frame: true}}
  - {{type: ModelTfPublisher, name: tf, update_rate: 50, after_step: true}}
  - {{type: Laser, name: laser, body: base, range: 20, update_rate: 50, after_step: true,
     angle: {{min: -1.5, max: 1.5, increment: 0.5}}}}
"""


PERIOD = 0.02  # s, of all messages


@pytest.fixture(scope="module")
def robot(module_launcher: Any, module_ros: Any, write_world: Callable[..., Path]) -> Any:
    """The node with a tricycle; returns its command."""
    models = "[{name: robot, model: robot.model.yaml}]"
    module_launcher.server(write_world(models, robot=ROBOT), lockstep=True, seed=1)
    return module_ros.publisher("/cmd_vel", Twist)


def test_the_tree_of_frames_is_complete(robot: Any, ros: Any) -> None:
    del robot
    transforms = ros.ready_topic("/tf", TFMessage)
    parents: dict[str, str] = {}
    ros.step(0.1)

    def complete(message: Any) -> bool:
        parents.update({t.child_frame_id: t.header.frame_id for t in message.transforms})
        return len(parents) == 5

    transforms.until(complete)
    assert parents.pop("base") == "odom"
    assert parents == dict.fromkeys(("front", "left", "right", "laser"), "base")


def test_scans_have_transforms_of_their_time(robot: Any, ros: Any) -> None:
    del robot
    transforms, scans = ros.ready_topic("/tf", TFMessage), ros.ready_topic("/scan", LaserScan)
    ros.step(0.1)
    for scan in scans.take(5):
        stamp = scan.header.stamp
        message = transforms.until(lambda m, due=stamp: m.transforms[0].header.stamp >= due)
        stamps = {t.child_frame_id: t.header.stamp for t in message.transforms}
        assert stamps["base"] == stamps["laser"] == stamp
        # 50 Hz, without the state at time 0.
        assert stamp.to_nsec() % 20_000_000 == 0
        assert stamp.to_nsec() > 0


def test_a_planner_commands_speed_and_yaw_rate(robot: Any, ros: Any) -> None:
    truths, odometry = (
        ros.ready_topic(f"/odometry/{name}", Odometry) for name in ("ground_truth", "filtered")
    )
    command = Twist()
    command.linear.x, command.angular.z = 0.3, -0.4
    robot.publish(command)

    def turning() -> Any:
        velocity = truths.next().twist.twist
        return velocity if abs(velocity.angular.z + 0.4) < 0.01 else None

    truth = ros.step_until("the yaw rate", turning, PERIOD)
    # At the front wheel, 1 m before the rear axle.
    assert (truth.linear.x, truth.linear.y) == pytest.approx((0.3, -0.4), abs=0.01)

    def drifted() -> Any:
        message = odometry.next()
        return message if message.pose.covariance[35] > 0.001 else None

    message = ros.step_until("a drift", drifted, PERIOD)
    assert message.header.frame_id == "odom"
    assert min(message.pose.covariance[i] for i in (0, 7, 35)) > 0
    assert min(message.twist.covariance[i] for i in (0, 7, 35)) > 0
