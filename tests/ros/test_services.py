"""The services of a running node: effects, refusals and messages."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rospy
from geometry_msgs.msg import Pose2D, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty
from waiting import TIMEOUT, wait_until

from flatland.msg import ModelPose, ModelSpec, ModelStates
from flatland.srv import (
    DeleteModels,
    GetModelStates,
    MoveModels,
    SetRate,
    SpawnModels,
    WaitUntilReady,
)

NAN, INF = float("nan"), float("inf")
STEP_NS = 5_000_000
BALL = "{bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]}"
ROBOT_PUBLISHERS = {"scan", "odometry/filtered", "odometry/ground_truth", "twist"}


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world(
        "[{name: first, model: robot.model.yaml, namespace: first, pose: [3, 3, 0]}]",
        clock="bodies: [{name: b, footprints: []}]\n"
        "plugins: [{name: p, type: DiffDrive, body: b, odom_pub: /clock}]\n",
    )


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path) -> Any:
    return module_launcher.server(world)


@pytest.fixture(autouse=True)
def restored_world(ros: Any) -> Iterator[None]:
    """Resumes the world after each test, and checks that only the model of the file is left."""
    yield
    ros.call("/resume", Empty)
    assert states(ros).name == ["first"]


def truth(ros: Any, namespace: str) -> Any:
    """Subscribes to the true pose of a robot."""
    return ros.topic(f"/{namespace}/odometry/ground_truth", Odometry)


def states(ros: Any, *names: str) -> ModelStates:
    """Returns the states of all models or of some of them."""
    answer = ros.call("/get_model_states", GetModelStates, names)
    assert (answer.success, answer.message) == (True, "")
    return answer.states


def test_spawn_move_and_delete(ros: Any) -> None:
    answer = ros.spawn("robot.model.yaml", "new", "new", (1, 2, 0.5))
    assert (answer.success, answer.message) == (True, "")
    registered = ros.registered()
    assert {f"/new/{topic}" for topic in ROBOT_PUBLISHERS} <= registered["publishers"]
    assert "/new/cmd_vel" in registered["subscribers"]
    odometry = truth(ros, "new")
    pose = odometry.next().pose.pose
    assert (pose.position.x, pose.position.y) == pytest.approx((1, 2), abs=1e-5)

    answer = ros.move("new", (-1, -2, 0))
    assert (answer.success, answer.message) == (True, "")
    odometry.until(lambda m: abs(m.pose.pose.position.x + 1) < 1e-5)

    answer = ros.delete("new")
    assert (answer.success, answer.message) == (True, "")
    registered = ros.registered()
    assert not [name for name in registered["publishers"] if name.startswith("/new/")]


def test_wait_until_ready(ros: Any) -> None:
    def answer(timeout: float, *topics: str) -> tuple[bool, str]:
        answer = ros.call("/wait_until_ready", WaitUntilReady, topics, timeout)
        return answer.success, answer.message

    command, laser = "/first/cmd_vel", "first/scan"
    missing = f"no connection to {command}, {laser}"
    assert answer(0, command, laser) == (False, f"not ready after 0 s: {missing}")
    publisher = ros.publisher(command, Twist)
    assert answer(TIMEOUT, command) == (True, "")
    ros.topic("/first/scan", LaserScan)
    assert answer(TIMEOUT, command, laser) == (True, "")
    publisher.unregister()
    missing = f"no connection to {command}"
    wait_until("the end", lambda: answer(0, command) == (False, f"not ready after 0 s: {missing}"))
    assert answer(0, "/nothing") == (False, "not ready after 0 s: no connection to /nothing")


REFUSED = (
    ("missing.yaml", "m", "", (0, 0, 0), 'Flatland YAML: File does not exist, path="'),
    ("ball.model.yaml", "first", "", (0, 0, 0), "already exists"),
    ("ball.model.yaml", "m", "my robot", (0, 0, 0), "not a legal ROS name"),
    ("ball.model.yaml", "m", "", (NAN, 0, 0), "pose must be finite"),
    ("clock.model.yaml", "m", "", (0, 0, 0), '"/clock" has the type rosgraph_msgs/Clock already'),
    ("missing/ünïcode.yaml", "ñ", "", (0, 0, 0), "ünïcode"),
    ("/dev/zero", "m", "", (0, 0, 0), "it is not a regular file"),
    ("x" * 100_000, "m", "", (0, 0, 0), "File name too long"),
    ("a\0b", "m", "", (0, 0, 0), "Flatland YAML: File does not exist"),
)


def test_refused_spawns_have_a_reason_and_no_effect(ros: Any) -> None:
    before = ros.registered()
    for path, name, ns, pose, message in REFUSED:
        answer = ros.spawn(path, name, ns, pose)
        assert answer.success is False, message
        assert answer.message.startswith("Flatland ")
        assert message in answer.message
    assert ros.registered() == before
    assert not ros.delete("m").success


def test_unknown_model_is_neither_deleted_nor_moved(ros: Any) -> None:
    for verb, answer in (("delete", ros.delete("ghost")), ("move", ros.move("ghost", (0, 0, 0)))):
        assert answer.success is False
        text = f'Flatland World: failed to {verb} model, model with name "ghost" does not exist'
        assert answer.message.startswith(f"{text} (hint: ")


def test_name_of_a_model_need_not_be_a_legal_ros_name(ros: Any) -> None:
    for name in ("a b", "ä☃", "/", "~", "$(x)", "n" * 255):
        assert ros.spawn("ball.model.yaml", name).success
        assert "already exists" in ros.spawn("ball.model.yaml", name).message
        assert ros.move(name, (1, 1, 0)).success
        assert states(ros, name).name == [name]
        assert ros.delete(name).success
        assert not ros.delete(name).success


def test_a_name_with_control_characters_or_of_absurd_length_is_refused(ros: Any) -> None:
    before = states(ros).name
    for name in ("new\nline", "a\0b", "a/../b", "n" * 9999):
        response = ros.spawn("ball.model.yaml", name)
        assert not response.success
        assert "its name must have at most 255 characters" in response.message
        assert states(ros).name == before


@pytest.mark.parametrize(
    ("pause", "resume"), [("/pause", "/resume"), ("/toggle_pause", "/toggle_pause")]
)
def test_time_does_not_advance_while_paused(ros: Any, pause: str, resume: str) -> None:
    clock = ros.topic("/clock", Clock)
    ros.call(pause, Empty)
    if pause == "/pause":
        ros.call(pause, Empty)  # The second one has no effect.
    start = ros.step()
    # Each step on request is the next one: the loop makes none in between.
    assert [ros.step() for _ in range(20)] == [start + n * STEP_NS for n in range(1, 21)]
    last = start + 20 * STEP_NS
    clock.until(lambda message: message.clock.to_nsec() == last)
    ros.call(resume, Empty)
    assert clock.next().clock.to_nsec() == last + STEP_NS


def test_calls_of_concurrent_clients_succeed(ros: Any) -> None:
    problems: list[str] = []

    def client(number: int) -> None:
        for i in range(4):
            name = f"c{number}_{i}"
            answers = [
                ros.spawn("robot.model.yaml", name, name, (number, i / 10, 0)),
                ros.move(name, (0, 0, 0)),
                ros.delete(name),
            ]
            problems.extend(answer.message for answer in answers if not answer.success)

    threads = [threading.Thread(target=client, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert problems == []


def test_spawned_and_deleted_models_leave_nothing_registered(ros: Any) -> None:
    before = ros.registered()
    names = [f"m{number}" for number in range(6)]
    for number, name in enumerate(names):
        answer = ros.spawn("robot.model.yaml", name, name, (number % 5 - 2, number // 5, 0))
        assert answer.success, answer.message
    registered = ros.registered()
    topics = {f"/{name}/{topic}" for name in names for topic in ROBOT_PUBLISHERS}
    assert registered["publishers"] == before["publishers"] | topics
    assert registered["subscribers"] == before["subscribers"] | {f"/{n}/cmd_vel" for n in names}
    truth(ros, names[-1]).next()
    for name in names:
        assert ros.delete(name).success
    assert ros.registered() == before


def test_set_rate(ros: Any) -> None:
    clock = ros.topic("/clock", Clock)
    try:
        # At the first rate, one step would take a quarter of an hour.
        for rate, parameter in ((0.001, 0.001), (INF, 0.0)):
            answer = ros.call("/set_rate", SetRate, rate)
            assert (answer.success, answer.message) == (True, "")
            assert rospy.get_param("/flatland_server/update_rate") == parameter
        now = ros.step()
        clock.until(lambda message: message.clock.to_nsec() > now + 20 * STEP_NS)
    finally:
        ros.call("/set_rate", SetRate, 200.0)


# -- several models ------------------------------------------------------------------------


def test_models_are_spawned_moved_and_deleted_together(ros: Any) -> None:
    before = ros.registered()
    models = [ModelSpec("robot.model.yaml", f"m{i}", f"m{i}", Pose2D(i, -3, 0.5)) for i in range(3)]
    models[1].yaml_path = BALL
    answer = ros.call("/spawn_models", SpawnModels, models)
    assert (answer.success, answer.message, answer.index) == (True, "", -1)
    assert answer.poses == [model.pose for model in models]
    assert {"/m0/scan", "/m2/scan"} <= ros.registered()["publishers"]
    moves = [ModelPose(f"m{i}", Pose2D(i, 2, 0)) for i in (2, 0)]
    answer = ros.call("/move_models", MoveModels, moves)
    assert (answer.success, answer.message, answer.index) == (True, "", -1)
    assert answer.poses == [move.pose for move in moves]
    poses = states(ros, "m2", "m1", "m0").pose
    assert poses == [moves[0].pose, models[1].pose, moves[1].pose]
    answer = ros.call("/delete_models", DeleteModels, ["m0", "m1", "m2"])
    assert (answer.success, answer.message, answer.index) == (True, "", -1)
    assert ros.registered() == before


def test_a_failed_call_leaves_everything_as_it_was(ros: Any) -> None:
    before = ros.registered()
    models = [
        ModelSpec("robot.model.yaml", "m0", "m0", Pose2D()),
        ModelSpec("{bodies: []}", "bad", "", Pose2D()),
    ]
    answer = ros.call("/spawn_models", SpawnModels, models)
    assert (answer.success, answer.index, answer.poses) == (False, 1, [])
    assert answer.message.startswith('Flatland World: models[1]: Invalid "bodies" in "bad" model')
    answer = ros.call("/move_models", MoveModels, [ModelPose("ghost", Pose2D())])
    assert (answer.success, answer.index, answer.poses) == (False, 0, [])
    answer = ros.call("/delete_models", DeleteModels, ["first", "ghost"])
    assert (answer.success, answer.index) == (False, 1)
    assert ros.registered() == before


def test_states_of_models_are_published_and_returned(ros: Any) -> None:
    ros.call("/pause", Empty)
    topic = ros.ready_topic("/model_states", ModelStates)
    ros.step()
    assert ros.spawn("ball.model.yaml", "ä☃", pose=(-3, 1, 0.5)).success
    # Without a step, since a change of a paused world is published.
    received, expected = topic.until(lambda message: len(message.name) == 2), states(ros)
    assert (expected.name, expected.ns) == (["first", "ä☃"], ["first", ""])
    assert expected.pose[1] == Pose2D(-3, 1, 0.5)
    received.header.seq = expected.header.seq = 0
    assert received == expected
    assert states(ros, "ä☃", "first", "ä☃").ns == ["", "first", ""]
    assert ros.delete("ä☃").success
    answer = ros.call("/get_model_states", GetModelStates, ["first", "ghost"])
    assert answer.success is False
    assert answer.message.startswith('Flatland World: model with name "ghost" does not exist')
    assert answer.states == ModelStates()
