"""`spawn_models`, `move_models` and `delete_models` of a running node, and models from text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Pose2D
from nav_msgs.msg import Odometry
from waiting import wait_until

from flatland.msg import DebugTopicList, ModelPose, ModelSpec
from flatland.srv import DeleteModels, MoveModels, SpawnModels

BALL = "{bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]}"


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world(
        "[{name: first, model: robot.model.yaml, namespace: first, pose: [3, 3, 0]}]",
        broken="bodies: []\n",
    )


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path) -> Any:
    return module_launcher.server(world, show_viz=True)


@pytest.fixture(autouse=True)
def restored_world(ros: Any) -> Iterator[None]:
    """Checks after each test that only the model of the file is left."""
    yield
    assert ros.registered()["subscribers"] == {"/first/cmd_vel"}


def specs(count: int, path: str = "robot.model.yaml") -> list[ModelSpec]:
    return [ModelSpec(path, f"m{i}", f"m{i}", Pose2D(i - 3, -3, 0.5)) for i in range(count)]


def delete(ros: Any, count: int) -> Any:
    return ros.call("/delete_models", DeleteModels, [f"m{i}" for i in range(count)])


def debug_topics(ros: Any) -> set[str]:
    """Returns the registered debug topics of models."""
    return {name for name in ros.registered()["publishers"] if "/debug/model/" in name}


def truth(ros: Any, name: str) -> Any:
    return ros.topic(f"/{name}/odometry/ground_truth", Odometry)


def test_spawn_move_and_delete(ros: Any) -> None:
    answer = ros.call("/spawn_models", SpawnModels, specs(4))
    assert (answer.success, answer.message, answer.index) == (True, "", -1)
    assert [(pose.x, pose.y) for pose in answer.poses] == [(i - 3, -3) for i in range(4)]
    registered = ros.registered()
    for i in range(4):
        assert f"/m{i}/scan" in registered["publishers"]
        assert f"/m{i}/cmd_vel" in registered["subscribers"]
    odometry = truth(ros, "m3")

    moves = [ModelPose(f"m{i}", Pose2D(i - 3, 2, 0)) for i in (1, 3)]
    answer = ros.call("/move_models", MoveModels, moves)
    assert (answer.success, answer.message, answer.index) == (True, "", -1)
    assert answer.poses == [Pose2D(-2, 2, 0), Pose2D(0, 2, 0)]
    odometry.until(lambda m: abs(m.pose.pose.position.y - 2) < 1e-5)

    answer = delete(ros, 4)
    assert (answer.success, answer.message, answer.index) == (True, "", -1)
    assert not [
        name for name in ros.registered()["publishers"] if name.startswith(("/m0/", "/m3/"))
    ]


@pytest.mark.parametrize("text", [BALL, f"\n{BALL[1:-1]}", "\n" + BALL])
def test_text_instead_of_a_path(ros: Any, text: str) -> None:
    assert ros.spawn(text, "t", "", (1, 1, 0)).success
    assert ros.delete("t").success
    assert ros.call("/spawn_models", SpawnModels, specs(2, text)).success
    assert delete(ros, 2).success


def test_a_failed_call_leaves_everything_as_it_was(ros: Any) -> None:
    # The debug topics of models that other tests have deleted are closed some time later.
    only = {"/flatland_server/debug/model/first"}
    wait_until("the topics of the only model", lambda: debug_topics(ros) == only)
    topics = ros.topic("/flatland_server/debug/topics", DebugTopicList)
    before, listed = ros.registered(), topics.next()
    models = specs(3)
    models[1] = ModelSpec("{bodies: []}", "bad", "", Pose2D(0, 0, 0))
    answer = ros.call("/spawn_models", SpawnModels, models)
    assert (answer.success, answer.index, answer.poses) == (False, 1, [])
    assert answer.message.startswith('Flatland World: models[1]: Invalid "bodies" in "bad" model')
    answer = ros.call("/move_models", MoveModels, [ModelPose("ghost", Pose2D())])
    assert (answer.success, answer.index, answer.poses) == (False, 0, [])
    answer = ros.call("/delete_models", DeleteModels, ["first", "ghost"])
    assert (answer.success, answer.index) == (False, 1)
    assert ros.registered() == before
    assert all(other == listed for other in topics.rest())
    assert "does not exist" in ros.delete("m0").message
