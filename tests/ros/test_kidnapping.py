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
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import InteractiveMarkerFeedback

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


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world(MODELS, kidnapped=KIDNAPPED)


@pytest.fixture(scope="module")
def kidnapping(module_launcher: Any, world: Path) -> Any:
    """A server, started by the launch file, that keeps the odometry of moved models."""
    process = module_launcher.launch(
        "flatland",
        "server.launch",
        f"world_path:={world}",
        "show_viz:=false",
        "if_blocked:=refuse",
        "move_keeps_odometry:=true",
        "initialpose_model:=007",
    )
    process.wait_for_line("loaded ")
    return process


@pytest.fixture(scope="module")
def initialpose(kidnapping: Any, module_ros: Any) -> Any:
    """A publisher for the server, shared by all tests, as advertising takes long."""
    assert kidnapping.running
    return module_ros.publisher("/initialpose", PoseWithCovarianceStamped)


class Robot:
    """Ground truth, odometry and transform of the first robot."""

    def __init__(self, ros: Any) -> None:
        # In this order, so that the transform of each odometry and the odometry of each truth
        # are received.
        self._transforms = ros.topic("/tf", TFMessage)
        self._odometry = ros.topic("/r1/odometry/filtered", Odometry)
        self._truth = ros.topic("/r1/odometry/ground_truth", Odometry)

    def arrives(self, place: tuple[float, float]) -> Any:
        """Waits until the robot is at a place; returns the stamp."""
        message = self._truth.until(lambda m: math.dist(_xy(m.pose.pose.position), place) < 1e-3)
        return message.header.stamp

    def odometry(self, stamp: Any) -> tuple[float, float]:
        """Returns the odometry at a time, which is also that of the transform."""
        message = self._odometry.until(lambda m: m.header.stamp >= stamp)
        assert message.header.stamp == stamp
        transform = next(
            transform.transform
            for transform in self._transforms.until(
                lambda m: any(_is_of_r1(t) and t.header.stamp == stamp for t in m.transforms)
            ).transforms
            if _is_of_r1(transform)
        )
        place = _xy(message.pose.pose.position)
        assert place == pytest.approx(_xy(transform.translation))
        return place


def _xy(point: Any) -> tuple[float, float]:
    return (point.x, point.y)


def _is_of_r1(transform: Any) -> bool:
    return bool(transform.child_frame_id == "r1_base")


def initial_pose(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> Any:
    message = PoseWithCovarianceStamped()
    message.header.frame_id = frame
    message.pose.pose.position = Point(x, y, 0)
    message.pose.pose.orientation = Quaternion(0, 0, math.sin(yaw / 2), math.cos(yaw / 2))
    return message


def test_by_default_the_odometry_jumps_along(launcher: Any, ros: Any, world: Path) -> None:
    # The first test, as two servers cannot run at the same time.
    launcher.server(world)
    robot = Robot(ros)
    assert robot.odometry(robot.arrives(START)) == pytest.approx(START, abs=1e-3)
    assert ros.move("007", (*AWAY, 1.0)).success
    assert robot.odometry(robot.arrives(AWAY)) == pytest.approx(AWAY, abs=1e-3)
    assert "/initialpose" not in ros.registered()["subscribers"]


def test_move_model_keeps_the_odometry(kidnapping: Any, ros: Any) -> None:
    robot = Robot(ros)
    before = robot.odometry(robot.arrives(START))
    assert before == pytest.approx(START, abs=1e-3)
    assert ros.move("007", (*AWAY, 1.0)).success
    assert robot.odometry(robot.arrives(AWAY)) == pytest.approx(before, abs=1e-3)
    assert ros.move("007", (*START, 0.5)).success
    robot.arrives(START)
    assert kidnapping.running


def test_dragging_keeps_the_odometry(kidnapping: Any, ros: Any) -> None:
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
        assert robot.odometry(robot.arrives(place)) == pytest.approx(START, abs=1e-3)
    assert kidnapping.running


@pytest.mark.parametrize("frame", ["map", "/map", "earth"])
def test_initialpose_moves_the_model_and_keeps_its_odometry(
    initialpose: Any, ros: Any, frame: str
) -> None:
    robot = Robot(ros)
    initialpose.publish(initial_pose(*AWAY, 2.0, frame))
    assert robot.odometry(robot.arrives(AWAY)) == pytest.approx(START, abs=1e-3)
    initialpose.publish(initial_pose(*START))
    assert robot.odometry(robot.arrives(START)) == pytest.approx(START, abs=1e-3)


def test_initialpose_while_paused_takes_effect(initialpose: Any, ros: Any) -> None:
    ros.call("/pause", Empty)
    initialpose.publish(initial_pose(*AWAY))
    ros.call("/resume", Empty)
    robot = Robot(ros)
    robot.arrives(AWAY)
    initialpose.publish(initial_pose(*START))
    robot.arrives(START)


@pytest.mark.parametrize(
    ("message", "warning"),
    [
        (
            initial_pose(0, 0, frame="odom"),
            'initialpose: ignoring a pose in frame "odom", expected "map"',
        ),
        (initial_pose(0, 0, frame=""), 'initialpose: ignoring a pose in frame "", expected "map"'),
        (initial_pose(math.nan, 0), "initialpose: ignoring a pose that is not finite"),
        (
            initial_pose(-1, -1.8),
            'initialpose: Flatland World: failed to move model "007", it overlaps model "other"',
        ),
        (
            initial_pose(2e9, 0),
            'initialpose: Flatland World: failed to move model "007", pose must be finite',
        ),
    ],
    ids=["frame", "empty frame", "nan", "blocked", "range"],
)
def test_invalid_initialpose_is_ignored_with_a_warning(
    kidnapping: Any, initialpose: Any, ros: Any, message: Any, warning: str
) -> None:
    initialpose.publish(message)
    line = kidnapping.wait_for_line(warning).string
    assert "[WARN]" in line
    Robot(ros).arrives(START)


def test_initialpose_of_a_model_that_does_not_exist(
    kidnapping: Any, initialpose: Any, ros: Any
) -> None:
    assert ros.delete("007").success
    initialpose.publish(initial_pose(0, 0))
    kidnapping.wait_for_line(
        r'\[WARN\].*initialpose: Flatland World: model with name "007" does not exist'
    )
    # The model may be spawned later.
    assert ros.spawn("kidnapped.model.yaml", "007", "r1", (0.0, -4.0, 0.0)).success
    initialpose.publish(initial_pose(*START))
    Robot(ros).arrives(START)
