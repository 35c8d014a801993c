"""Trailers, wheel encoders and cars of a running node."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Pose2D, Twist
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from flatland.srv import MoveModel, SpawnModel, StepWorld

CAR = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: AckermannDrive, name: drive, body: base, wheelbase: 1, max_steer_angle: 0.5,
     command: ackermann}
"""


@pytest.fixture
def start(launcher: Any, checkout: Path) -> Any:
    def run(name: str) -> Any:
        world = checkout / "worlds" / name / "world.yaml"
        return launcher.server(world, lockstep=True, seed=1, show_viz=False)

    return run


def step(ros: Any, duration: float) -> None:
    answer = ros.call("/step_world", StepWorld, duration)
    assert answer.success, answer.message


def test_hitch_by_service_and_topic(ros: Any, start: Any) -> None:
    start("trailers")
    state = ros.topic("/hitched", Bool)
    step(ros, 0.5)
    assert state.until(lambda message: message.data)
    answer = ros.call("/set_hitch", SetBool, False)
    assert (answer.success, answer.message) == (True, "released: trailer1")
    step(ros, 0.5)
    assert state.until(lambda message: not message.data)
    assert ros.call("/move_model", MoveModel, "tractor", Pose2D(14.0, 3.0, 0.0)).success
    answer = ros.call("/set_hitch", SetBool, True)
    assert not answer.success
    assert answer.message.endswith("no model is within 0.1 m")
    assert ros.call("/move_model", MoveModel, "tractor", Pose2D(10.0, 3.0, 0.0)).success
    ros.publisher("/hitch", Bool).publish(True)
    for _ in range(100):
        step(ros, 0.1)
        if state.until(lambda message: True).data:
            break
    else:
        pytest.fail("the trailer was not connected")


def test_wheel_states_of_a_car(ros: Any, start: Any) -> None:
    start("drives")
    wheels = ros.topic("/car/joint_states", JointState)
    command = ros.publisher("/car/cmd_vel", Twist)
    drive = Twist()
    drive.linear.x = 1.0
    command.publish(drive)
    for _ in range(100):
        step(ros, 0.1)
        message = wheels.next()
        if message.position[0] > 0.0:
            break
    else:
        pytest.fail("the car does not move")
    assert message.name == [
        f"{axle}_{side}_wheel" for axle in ("front", "rear") for side in ("left", "right")
    ]
    ticks = [angle / math.tau * 2048 for angle in message.position]
    assert ticks == pytest.approx([round(tick) for tick in ticks], abs=1e-6)
    assert len(message.velocity) == 4
    assert not message.effort


@pytest.mark.skipif(
    importlib.util.find_spec("ackermann_msgs") is not None, reason="ackermann_msgs is installed"
)
def test_a_missing_message_package_is_named(ros: Any, start: Any) -> None:
    start("drives")
    answer = ros.call("/spawn_model", SpawnModel, "\n" + CAR, "new", "new", Pose2D())
    assert not answer.success
    assert "ackermann requires the ROS package ackermann_msgs, which is not installed" in (
        answer.message
    )
