"""`spawn_models`, `move_models` and `delete_models` of a running node, and models from text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rospy
from geometry_msgs.msg import Pose2D
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty
from waiting import TIMEOUT, wait_until

from flatland.msg import DebugTopicList, ModelPose, ModelSpec
from flatland.srv import DeleteModels, MoveModels, SpawnModels

NAN = float("nan")
BALL = "{bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]}"


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world(
        "[{name: first, model: robot.model.yaml, namespace: first, pose: [3, 3, 0]}]",
        broken="bodies: []\n",
    )


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path) -> Any:
    return module_launcher.server(world, if_blocked="refuse", show_viz=True)


@pytest.fixture(autouse=True)
def restored_world(ros: Any) -> Iterator[None]:
    """Checks after each test that only the model of the file is left."""
    yield
    assert ros.registered()["subscribers"] == {"/first/cmd_vel"}


def specs(count: int, path: str = "robot.model.yaml") -> list[ModelSpec]:
    return [ModelSpec(path, f"m{i}", f"m{i}", Pose2D(i - 3, -3, 0.5)) for i in range(count)]


def delete(ros: Any, count: int) -> Any:
    return ros.call("/delete_models", DeleteModels, [f"m{i}" for i in range(count)])


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


def test_requests_without_models_succeed(ros: Any) -> None:
    assert ros.call("/spawn_models", SpawnModels, []).success
    assert ros.call("/move_models", MoveModels, []).success
    assert ros.call("/delete_models", DeleteModels, []).success


@pytest.mark.parametrize("text", [BALL, f"\n{BALL[1:-1]}", "\n" + BALL])
def test_text_instead_of_a_path(ros: Any, text: str) -> None:
    assert ros.spawn(text, "t", "", (1, 1, 0)).success
    assert ros.delete("t").success
    assert ros.call("/spawn_models", SpawnModels, specs(2, text)).success
    assert delete(ros, 2).success


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{bodies: [}", 'models[1]: Malformatted file, path="<text>", line 1'),
        ("\nbodies:\n- {nam: x}", 'models[1]: Entry "name" does not exist'),
        ("\nbodies:\n- {nam: x}", "[<text>:3]"),
        ("{bodies: []}", 'models[1]: Invalid "bodies" in "bad" model'),
        ("{bodies: $include none.yaml}", "does not exist, path="),
        ("\n", 'models[1]: Entry "bodies" does not exist'),
        ("broken.model.yaml", 'Invalid "bodies" in "bad" model, must be a list'),
        ("missing.yaml", "models[1]: File does not exist"),
        ("", "models[1]: failed to spawn"),
        ("a\0b", "models[1]: File does not exist"),
    ],
)
def test_a_failed_spawn_leaves_everything_as_it_was(ros: Any, text: str, message: str) -> None:
    topics = ros.topic("/flatland_server/debug/topics", DebugTopicList)
    before, listed = ros.registered(), topics.next()
    models = specs(3)
    models[1] = ModelSpec(text, "bad", "", Pose2D(0, 0, 0))
    answer = ros.call("/spawn_models", SpawnModels, models)
    assert (answer.success, answer.index, answer.poses) == (False, 1, [])
    assert answer.message.startswith("Flatland World: models[1]: ")
    assert message in answer.message
    assert ros.registered() == before
    assert all(other == listed for other in topics.rest())
    assert "does not exist" in ros.delete("m0").message


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (ModelSpec(BALL, "first", "", Pose2D()), 'Model with name "first" already exists'),
        (ModelSpec(BALL, "m0", "", Pose2D()), 'Model with name "m0" already exists'),
        (ModelSpec(BALL, "", "", Pose2D()), "its name must not be empty"),
        (ModelSpec(BALL, "x", "my ns", Pose2D()), "is not a legal ROS name"),
        (ModelSpec(BALL, "x", "", Pose2D(NAN, 0, 0)), "pose must be finite"),
        (ModelSpec(BALL, "x", "", Pose2D(1e300, 0, 0)), "must be finite and within"),
        (ModelSpec(BALL, "x", "", Pose2D(-3, -3, 0)), 'it overlaps model "m0"'),
        (ModelSpec(BALL, "x", "", Pose2D(5, 0, 0)), 'it overlaps layer "2d"'),
    ],
)
def test_an_invalid_model_is_named_by_its_index(ros: Any, model: Any, message: str) -> None:
    answer = ros.call("/spawn_models", SpawnModels, [*specs(2), model])
    assert (answer.success, answer.index) == (False, 2)
    assert answer.message.startswith("Flatland World: models[2]: ")
    assert message in answer.message


class TestWithModels:
    @pytest.fixture(autouse=True)
    def models(self, ros: Any) -> Iterator[None]:
        assert ros.call("/spawn_models", SpawnModels, specs(3)).success
        yield
        assert delete(ros, 3).success

    @pytest.mark.parametrize(
        ("moves", "index", "message"),
        [
            ([("m0", 0, 0), ("ghost", 1, 1)], 1, '"ghost" does not exist'),
            ([("m0", 0, 0), ("m0", 1, 1)], 1, '"m0" occurs twice'),
            ([("m0", 0, 0), ("m1", NAN, 0)], 1, "must be finite"),
            ([("m0", 0, 0), ("m1", 1e300, 0)], 1, "must be finite"),
            ([("m0", 0, 0), ("m1", 3, 3)], 1, 'overlaps model "first"'),
            ([("m0", 0, 0), ("m1", 0.1, 0)], 0, 'overlaps model "m1"'),
        ],
    )
    def test_a_failed_move_moves_nothing(
        self, ros: Any, moves: Any, index: int, message: str
    ) -> None:
        odometry = truth(ros, "m0")
        requested = [ModelPose(name, Pose2D(x, y, 0)) for name, x, y in moves]
        answer = ros.call("/move_models", MoveModels, requested)
        assert (answer.success, answer.index, answer.poses) == (False, index, [])
        assert answer.message.startswith(f"Flatland World: models[{index}]: ")
        assert message in answer.message
        odometry.drop()
        position = odometry.next().pose.pose.position
        assert (position.x, position.y) == pytest.approx((-3, -3), abs=1e-5)

    def test_models_exchange_their_places_while_paused(self, ros: Any) -> None:
        ros.call("/pause", Empty)
        moves = [ModelPose("m0", Pose2D(-2, -3, 0)), ModelPose("m1", Pose2D(-3, -3, 0))]
        assert ros.call("/move_models", MoveModels, moves).success
        ros.call("/resume", Empty)
        odometry = truth(ros, "m0")
        odometry.until(lambda m: abs(m.pose.pose.position.x + 2) < 1e-5)

    @pytest.mark.parametrize(
        ("names", "index", "message"),
        [
            (["m0", "ghost"], 1, '"ghost" does not exist'),
            (["m0", "m1", "m0"], 2, '"m0" occurs twice'),
            ([""], 0, '"" does not exist'),
        ],
    )
    def test_a_failed_deletion_deletes_nothing(
        self, ros: Any, names: list[str], index: int, message: str
    ) -> None:
        before = ros.registered()
        answer = ros.call("/delete_models", DeleteModels, names)
        assert (answer.success, answer.index) == (False, index)
        assert answer.message.startswith(f"Flatland World: names[{index}]: ")
        assert message in answer.message
        assert ros.registered() == before


class TestOtherServers:
    """Other servers replace the one of this file from here on."""

    @pytest.fixture(autouse=True)
    def restored_world(self) -> None:
        """Nothing to restore."""

    def test_nearest_places_are_returned(
        self, launcher: Any, ros: Any, world: Path, server: Any
    ) -> None:
        server.stop()
        launcher.server(world, if_blocked="nearest")
        models = [ModelSpec(BALL, f"b{i}", "", Pose2D(0, 0, 0)) for i in range(3)]
        answer = ros.call("/spawn_models", SpawnModels, models)
        assert answer.success
        assert answer.message.count("the requested pose is blocked") == 2
        assert answer.poses[0] == Pose2D(0, 0, 0)
        assert len({(pose.x, pose.y) for pose in answer.poses}) == 3

    def test_text_is_not_restricted_but_its_includes_are(
        self, launcher: Any, ros: Any, world: Path, tmp_path: Path
    ) -> None:
        launcher.server(world, model_path=str(tmp_path))
        assert ros.spawn(BALL, "t").success
        (world.parent / "bodies.yaml").write_text("[]")
        answer = ros.spawn("{bodies: $include bodies.yaml}", "u")
        assert answer.success is False
        assert "outside the folders of model_path" in answer.message

    def test_many_models(self, launcher: Any, ros: Any, world: Path) -> None:
        launcher.server(world)
        models = [
            ModelSpec(BALL, f"b{i}", "", Pose2D(i % 20 / 5 - 2, i // 20 / 5, 0)) for i in range(200)
        ]
        proxy = rospy.ServiceProxy("/spawn_models", SpawnModels)
        rospy.wait_for_service("/spawn_models", TIMEOUT)
        assert len(proxy(models).poses) == 200
        assert ros.call("/delete_models", DeleteModels, [model.name for model in models]).success
        wait_until("no model", lambda: not ros.delete("b199").success)
