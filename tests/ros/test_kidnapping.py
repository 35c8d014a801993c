"""Models that are moved while their odometry continues: `~move_keeps_odometry`, `initialpose`."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point, PoseWithCovarianceStamped, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import InteractiveMarkerFeedback
from waiting import wait_until

KIDNAPPED = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50, ground_truth_frame_id: earth}
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


@pytest.fixture(scope="module")
def initialpose(server: Any, module_ros: Any) -> Any:
    """A publisher for the server, shared by all tests, as advertising takes long."""
    del server
    return module_ros.publisher("/initialpose", PoseWithCovarianceStamped)


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


def initial_pose(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> Any:
    message = PoseWithCovarianceStamped()
    message.header.frame_id = frame
    message.pose.pose.position = Point(x, y, 0)
    message.pose.pose.orientation = Quaternion(0, 0, math.sin(yaw / 2), math.cos(yaw / 2))
    return message


def test_move_model_keeps_the_odometry(ros: Any) -> None:
    robot = Robot(ros)
    assert robot.is_at(START)
    assert ros.move("007", (*AWAY, 1.0)).success
    assert robot.is_at(AWAY)
    assert ros.move("007", (*START, 0.5)).success
    assert robot.is_at(START)


def test_dragging_keeps_the_odometry(ros: Any) -> None:
    robot = Robot(ros)
    feedback = ros.publisher("/interactive_model_markers/feedback", InteractiveMarkerFeedback)
    for place in (AWAY, START):
        message = InteractiveMarkerFeedback(
            client_id="test",
            marker_name="007",
            event_type=InteractiveMarkerFeedback.MOUSE_UP,
            pose=PoseMessage(Point(*place, 0), Quaternion(0, 0, 0, 1)),
        )
        message.header.frame_id = "map"
        feedback.publish(message)
        wait_until("the dragged robot", lambda place=place: robot.is_at(place))


@pytest.mark.parametrize("frame", ["map", "/map", "earth"])
def test_initialpose_moves_the_model_and_keeps_its_odometry(
    initialpose: Any, ros: Any, frame: str
) -> None:
    robot = Robot(ros)
    for place in (AWAY, START):
        initialpose.publish(initial_pose(*place, 2.0, frame))
        wait_until("the moved robot", lambda place=place: robot.is_at(place))
