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
from waiting import wait_until

PERIOD = 0.02  # s, of the odometry


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world("[{name: robot, model: robot.model.yaml, namespace: r1}]")
    return module_launcher.server(world, lockstep=True)


@pytest.fixture(scope="module")
def commands(server: Any, module_ros: Any) -> Any:
    """A publisher shared by all tests, as advertising takes long."""
    del server
    return module_ros.publisher("/r1/cmd_vel", Twist)


@pytest.fixture
def robot(ros: Any) -> Any:
    """Returns the next odometry, after a step to its time; at first, the robot is at the origin."""
    ros.reset()
    odometry = ros.ready_topic("/r1/odometry/ground_truth", Odometry)

    def advance() -> Any:
        ros.step(PERIOD)
        return odometry.next()

    return advance


def twist(linear: float, angular: float) -> Twist:
    return Twist(Vector3(linear, 0, 0), Vector3(0, 0, angular))


def test_robot_follows_the_command(commands: Any, robot: Any) -> None:
    def moving() -> Any:
        message = robot()
        return message if message.twist.twist.linear.x > 0 else None

    commands.publish(twist(0.5, 0.25))
    first = wait_until("a moving robot", moving)
    assert first.twist.twist.linear.x == pytest.approx(0.5, abs=1e-4)
    assert first.twist.twist.angular.z == pytest.approx(0.25, abs=1e-4)
    for _ in range(100):
        last = robot()
    # After 2 s, on a circle of radius 0.5 / 0.25 around (0, 2).
    position = last.pose.pose.position
    assert math.hypot(position.x, position.y - 2) == pytest.approx(2, abs=0.02)
    assert position.x > 0.5


def test_ignored_command_gives_a_warning_on_rosout(ros: Any, commands: Any, server: Any) -> None:
    log = ros.topic("/rosout", Log)

    def warning_of_the_command() -> Log | None:
        commands.publish(twist(math.nan, 0))  # the warning is logged at most once a second
        messages = log.rest(silence=0.1)
        return next((m for m in messages if "previous command remains" in m.msg), None)

    warning = wait_until("a warning on /rosout", warning_of_the_command)
    server.wait_for_line(r"\[WARN\].*previous command remains in effect")
    assert warning.level == Log.WARN
    assert warning.name == "/flatland_server"
    assert warning.file.endswith(".py")
