"""Trailers, wheel encoders and cars of a running node."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

CAR = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: AckermannDrive, name: drive, body: base, wheelbase: 1, max_steer_angle: 0.5,
     command: ackermann}
"""


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, checkout: Path) -> Any:
    world = checkout / "worlds" / "trailers" / "world.yaml"
    return module_launcher.server(world, lockstep=True, seed=1)


def test_hitch_by_service_and_topic(ros: Any) -> None:
    state = ros.ready_topic("/hitched", Bool)
    ros.step(0.5)
    state.until(lambda message: message.data)
    answer = ros.call("/set_hitch", SetBool, False)
    assert (answer.success, answer.message) == (True, "released: trailer1")
    ros.step(0.5)
    state.until(lambda message: not message.data)
    assert ros.move("tractor", (14.0, 3.0, 0.0)).success
    answer = ros.call("/set_hitch", SetBool, True)
    assert not answer.success
    assert answer.message.endswith("no model is within 0.1 m")
    assert ros.move("tractor", (10.0, 3.0, 0.0)).success
    ros.publisher("/hitch", Bool).publish(True)
    ros.step_until("a connected trailer", lambda: state.next().data)


def test_wheel_states_of_a_car(ros: Any, checkout: Path) -> None:
    car = checkout / "worlds" / "drives" / "car.model.yaml"
    assert ros.spawn(car, "car", "car", (5.0, 15.0, 0.0)).success
    wheels = ros.ready_topic("/car/joint_states", JointState)
    command = Twist()
    command.linear.x = 1.0
    ros.publisher("/car/cmd_vel", Twist).publish(command)

    def moved() -> Any:
        message = wheels.next()
        return message if message.position[0] > 0 else None

    message = ros.step_until("a moving car", moved)
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
def test_a_missing_message_package_is_named(ros: Any) -> None:
    answer = ros.spawn("\n" + CAR, "new", "new")
    assert not answer.success
    assert "ackermann requires the ROS package ackermann_msgs, which is not installed" in (
        answer.message
    )
