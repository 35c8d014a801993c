"""Models that are moved while their odometry continues: `~move_keeps_odometry`, `initialpose`."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, PoseWithCovarianceStamped, Quaternion
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage
from waiting import wait_until

KIDNAPPED = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50}
"""
MODELS = """[
  {name: '007', namespace: r1, model: kidnapped.model.yaml, pose: [1, 2, 0.5]},
  {name: other, namespace: r2, model: kidnapped.model.yaml, pose: [-1, -2, 0]}]"""
START = (1.0, 2.0)
AWAY = (-3.0, 3.0)
PERIOD = 0.02  # s, of the odometry


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """A server in lockstep that keeps the odometry of moved models."""
    return module_launcher.server(
        write_world(MODELS, kidnapped=KIDNAPPED),
        lockstep=True,
        if_blocked="refuse",
        move_keeps_odometry=True,
        initialpose_model="'007'",
    )


class Robot:
    """Ground truth, odometry and transform of the first robot."""

    def __init__(self, ros: Any) -> None:
        self._ros = ros
        self._transforms = ros.ready_topic("/tf", TFMessage)
        self._odometry = ros.ready_topic("/r1/odometry/filtered", Odometry)
        self._truth = ros.ready_topic("/r1/odometry/ground_truth", Odometry)

    def places(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Returns the place of the robot and that of its odometry and transform."""
        self._ros.step(PERIOD)  # one message on each topic
        truth, odometry = self._truth.next(), self._odometry.next()
        transforms = self._transforms.next().transforms
        (transform,) = (each for each in transforms if each.child_frame_id == "r1_base")
        assert truth.header.stamp == odometry.header.stamp == transform.header.stamp
        place = _xy(odometry.pose.pose.position)
        assert place == pytest.approx(_xy(transform.transform.translation))
        return _xy(truth.pose.pose.position), place

    def is_at(self, expected: tuple[float, float]) -> bool:
        """Returns whether the robot is at a place; its odometry must be at its start."""
        place, odometry = self.places()
        assert odometry == pytest.approx(START, abs=1e-3)
        return math.dist(place, expected) < 1e-3


def _xy(point: Any) -> tuple[float, float]:
    return (point.x, point.y)


def test_move_model_keeps_the_odometry(ros: Any) -> None:
    robot = Robot(ros)
    assert robot.is_at(START)
    assert ros.move("007", (*AWAY, 1.0)).success
    assert robot.is_at(AWAY)
    assert ros.move("007", (*START, 0.5)).success
    assert robot.is_at(START)


def test_initialpose_moves_the_model_and_keeps_its_odometry(ros: Any) -> None:
    robot = Robot(ros)
    publisher = ros.publisher("/initialpose", PoseWithCovarianceStamped)
    for place in (AWAY, START):
        message = PoseWithCovarianceStamped()
        message.header.frame_id = "/map"
        message.pose.pose = Pose(Point(*place, 0), Quaternion(0, 0, 1, 0))
        publisher.publish(message)
        wait_until("the moved robot", lambda place=place: robot.is_at(place))
