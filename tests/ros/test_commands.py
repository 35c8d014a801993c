"""Velocity commands from ROS: the last valid one is in effect."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world("[{name: robot, model: robot.model.yaml, namespace: r1}]")
    return module_launcher.server(world, update_rate=1000)


@pytest.fixture(autouse=True)
def start_at_origin(ros: Any) -> None:
    publisher = ros.publisher("/r1/cmd_vel", Twist)
    publisher.publish(Twist())
    odometry = ros.topic("/r1/odometry/ground_truth", Odometry)
    odometry.until(lambda m: m.twist.twist.linear.x == 0 and m.twist.twist.angular.z == 0)
    ros.move("robot", (0, 0, 0))
    odometry.until(lambda m: abs(m.pose.pose.position.x) + abs(m.pose.pose.position.y) < 1e-5)


def twist(linear: float, angular: float) -> Twist:
    return Twist(Vector3(linear, 0, 0), Vector3(0, 0, angular))


def test_robot_follows_the_command(ros: Any) -> None:
    odometry = ros.topic("/r1/odometry/ground_truth", Odometry)
    ros.publisher("/r1/cmd_vel", Twist).publish(twist(0.5, 0.25))
    first = odometry.until(lambda m: m.twist.twist.linear.x > 0)
    assert first.twist.twist.linear.x == pytest.approx(0.5, abs=1e-4)
    assert first.twist.twist.angular.z == pytest.approx(0.25, abs=1e-4)
    last = odometry.until(lambda m: m.header.stamp.to_sec() > first.header.stamp.to_sec() + 2)
    position = last.pose.pose.position
    # The robot drives in a circle of radius 0.5 / 0.25 around (0, 2).
    assert math.hypot(position.x, position.y - 2) == pytest.approx(2, abs=0.02)
    assert position.x > 0.5


def test_last_command_is_in_effect(ros: Any) -> None:
    odometry = ros.topic("/r1/odometry/ground_truth", Odometry)
    publisher = ros.publisher("/r1/cmd_vel", Twist)
    for i in range(100):
        publisher.publish(twist(0, i))
    publisher.publish(twist(0, -0.5))
    odometry.until(lambda m: m.twist.twist.angular.z == pytest.approx(-0.5, abs=1e-4))
    rates = [message.twist.twist.angular.z for message in odometry.take(5)]
    assert rates == pytest.approx([-0.5] * 5, abs=1e-4)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_command_that_is_not_finite_is_ignored(ros: Any, bad: float) -> None:
    odometry = ros.topic("/r1/odometry/ground_truth", Odometry)
    publisher = ros.publisher("/r1/cmd_vel", Twist)
    publisher.publish(twist(0.1, 0))
    odometry.until(lambda m: m.twist.twist.linear.x > 0.05)
    publisher.publish(twist(bad, 0))
    publisher.publish(twist(0, bad))
    velocities = [message.twist.twist.linear.x for message in odometry.take(10)]
    assert velocities == pytest.approx([0.1] * 10, abs=1e-4)


def test_ignored_command_gives_a_warning_on_rosout(
    ros: Any, server: Any, eventually: Callable[..., Any]
) -> None:
    log = ros.topic("/rosout", Log)
    publisher = ros.publisher("/r1/cmd_vel", Twist)

    def warning_of_the_command() -> Log | None:
        publisher.publish(twist(math.nan, 0))  # the warning is logged at most once a second
        messages = log.rest(silence=0.1)
        return next((m for m in messages if "previous command remains" in m.msg), None)

    warning = eventually("a warning on /rosout", warning_of_the_command)
    server.wait_for_line(r"\[WARN\].*previous command remains in effect")
    assert warning.level == Log.WARN
    assert warning.name == "/flatland_server"
    assert warning.file.endswith(".py")
