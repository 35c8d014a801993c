"""The topic `model_states` and the service `get_model_states` of a running node."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Pose2D, Twist
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty

from flatland.msg import ModelPose, ModelSpec, ModelStates
from flatland.srv import DeleteModels, GetModelStates, MoveModels, SpawnModels

STEP_NS = 5_000_000
MODELS = """
  - {name: first, model: robot.model.yaml, namespace: first, pose: [3, 3, 0]}
  - {name: ball, model: ball.model.yaml, pose: [-3, 1, 0.5]}
"""


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world(MODELS)


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path) -> Any:
    return module_launcher.server(world, lockstep=True, seed=1)


@pytest.fixture(autouse=True)
def fresh_world(ros: Any) -> None:
    ros.reset()


def states(ros: Any, *names: str) -> Any:
    answer = ros.call("/get_model_states", GetModelStates, list(names))
    assert (answer.success, answer.message) == (True, "")
    return answer.states


def test_states_of_all_models(ros: Any) -> None:
    got = states(ros)
    assert (got.name, got.ns) == (["first", "ball"], ["first", ""])
    assert got.header.frame_id == "map"
    assert got.header.stamp.to_nsec() == 0
    assert got.pose == [Pose2D(3, 3, 0), Pose2D(-3, 1, 0.5)]
    assert got.twist == [Twist(), Twist()]


def test_states_of_a_moving_model(ros: Any) -> None:
    truth = ros.ready_topic("/first/odometry/ground_truth", Odometry)
    command = Twist()
    command.linear.x, command.angular.z = 0.5, 0.25
    ros.publisher("/first/cmd_vel", Twist).publish(command)
    ros.step_until("a moving robot", lambda: states(ros, "first").twist[0].angular.z)
    got = states(ros, "first")
    now = got.header.stamp
    # The ground truth of the next step is that of its start.
    ros.step()
    odometry = truth.until(lambda message: message.header.stamp >= now)
    assert odometry.header.stamp == now
    position = odometry.pose.pose.position
    assert (got.pose[0].x, got.pose[0].y) == (position.x, position.y)
    twist = got.twist[0]
    assert twist.linear.x**2 + twist.linear.y**2 == pytest.approx(0.25, rel=1e-3)
    assert twist.angular.z == pytest.approx(0.25)
    assert (twist.linear.z, twist.angular.x, twist.angular.y) == (0, 0, 0)


def test_states_are_returned_in_the_order_of_the_request(ros: Any) -> None:
    got = states(ros, "ball", "first", "ball")
    assert got.name == ["ball", "first", "ball"]
    assert got.ns == ["", "first", ""]
    assert [pose.x for pose in got.pose] == [-3, 3, -3]


@pytest.mark.parametrize("name", ["ghost", "", "n" * 9999])
def test_an_unknown_model_is_an_error(ros: Any, name: str) -> None:
    answer = ros.call("/get_model_states", GetModelStates, ["first", name])
    assert answer.success is False
    assert answer.message == f'Flatland World: model with name "{name}" does not exist'
    assert answer.states == ModelStates()


def test_topic_equals_the_service_at_its_rate(ros: Any) -> None:
    topic = ros.ready_topic("/model_states", ModelStates)
    first = topic.next()  # without a step
    assert (first.name, first.header.stamp.to_nsec()) == (["first", "ball"], 0)
    # At 50 Hz, every fourth step of 5 ms, with the time after the step.
    end = ros.step(0.1)
    received = topic.take(5)
    times = [message.header.stamp.to_nsec() for message in received]
    assert times == list(range(4 * STEP_NS, end + 1, 4 * STEP_NS))
    expected = states(ros)
    received[-1].header.seq = expected.header.seq = 0
    assert received[-1] == expected


def test_changes_of_a_paused_world_are_published_once(ros: Any) -> None:
    ros.call("/pause", Empty)
    topic = ros.ready_topic("/model_states", ModelStates)
    topic.next()
    models = [ModelSpec("ball.model.yaml", f"b{i}", "", Pose2D(i, 0, 0)) for i in range(3)]
    assert ros.call("/spawn_models", SpawnModels, models).success
    assert topic.next().name == ["first", "ball", "b0", "b1", "b2"]
    moves = [ModelPose("b0", Pose2D(0, 1, 0)), ModelPose("b1", Pose2D(1, 1, 0))]
    assert ros.call("/move_models", MoveModels, moves).success
    assert topic.next().pose[2] == Pose2D(0, 1, 0)
    assert ros.call("/delete_models", DeleteModels, ["ball", "b1"]).success
    assert topic.next().name == ["first", "b0", "b2"]
    ros.reset()
    assert topic.next().name == ["first", "ball"]
    ros.call("/resume", Empty)


def test_names_outside_ascii(ros: Any) -> None:
    topic = ros.topic("/model_states", ModelStates)
    assert ros.spawn("ball.model.yaml", "ä☃\n").success
    assert topic.until(lambda message: len(message.name) == 3).name[2] == "ä☃\n"
    assert states(ros).name[2] == "ä☃\n"


def test_a_world_without_models(ros: Any) -> None:
    topic = ros.topic("/model_states", ModelStates)
    assert ros.call("/delete_models", DeleteModels, ["first", "ball"]).success
    message = topic.until(lambda message: message.name == [])
    assert (message.pose, message.twist) == ([], [])
    assert states(ros).name == []
