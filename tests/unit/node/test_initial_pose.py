"""Poses that other nodes send for a model, without ROS."""

from __future__ import annotations

import math
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import pytest

from flatland.node.initial_pose import _log_failure
from flatland.node.values import ReceivedPose

ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base, ground_truth_frame_id: /earth}]
"""
WORLD = """
properties: {}
layers: [{name: 2d}]
models:
- {name: '007', model: robot.model.yaml, pose: [1, 2, 0.5]}
- {name: other, namespace: r2, model: robot.model.yaml, pose: [-1, -2, 0]}
"""
START = (1.0, 2.0, 0.5)


@pytest.fixture
def node(serve: Any, files: Any) -> Any:
    files.write("robot.model.yaml", ROBOT)
    return serve(WORLD, lockstep=True, initialpose_model="007", if_blocked="refuse")


def send(node: Any, frame: str, pose: tuple[float, float, float] | None) -> Any:
    """Sends a pose; returns that of the model afterwards."""
    node.transport.callbacks["initialpose"](ReceivedPose(frame, pose))
    return node.run(lambda: node.world.model("007").pose)


@pytest.mark.parametrize("frame", ["map", "earth"])
def test_a_pose_in_a_frame_of_the_world_moves_the_model(node: Any, frame: str) -> None:
    assert send(node, frame, (-3.0, 3.0, 1.0)) == (-3.0, 3.0, 1.0)


@pytest.mark.parametrize(
    ("frame", "pose", "warning"),
    [
        ("odom", START, 'initialpose: ignoring a pose in frame "odom", expected "map"'),
        ("", START, 'initialpose: ignoring a pose in frame "", expected "map"'),
        ("map", None, "initialpose: ignoring a pose that is not finite or has no rotation"),
        ("map", (-1.0, -1.8, 0.0), 'failed to move model "007", it overlaps model "other"'),
        ("map", (2e9, 0.0, 0.0), 'failed to move model "007", pose must be finite'),
        ("map", (math.nan, 0.0, 0.0), 'failed to move model "007", pose must be finite'),
    ],
)
def test_other_poses_are_ignored_with_a_warning(
    node: Any, caplog: pytest.LogCaptureFixture, frame: str, pose: Any, warning: str
) -> None:
    assert send(node, frame, pose) == START
    assert warning in caplog.text


def test_the_model_may_be_spawned_later(node: Any, caplog: pytest.LogCaptureFixture) -> None:
    node.run(lambda: node.world.delete_model("007"))
    node.transport.callbacks["initialpose"](ReceivedPose("map", START))
    node.run(lambda: node.world.spawn_model("robot.model.yaml", "007"))
    assert 'initialpose: Flatland World: model with name "007" does not exist' in caplog.text
    assert send(node, "map", (3.0, 3.0, 0.0)) == (3.0, 3.0, 0.0)


@pytest.mark.parametrize("kept", [False, True])
def test_the_odometry_of_a_moved_model_jumps_along_by_default(
    serve: Any, files: Any, kept: bool
) -> None:
    files.write("robot.model.yaml", ROBOT)
    node = serve(WORLD, lockstep=True, **({"move_keeps_odometry": True} if kept else {}))
    assert ("initialpose" in node.transport.callbacks) is False
    odometry = node.transport.topics["odometry/filtered"]
    odometry.connect()
    away = SimpleNamespace(x=-3.0, y=3.0, theta=1.0)
    assert node.call("move_model", name="007", pose=away).success
    node.call("step_world", duration=0.0)
    assert odometry.sent[-1].pose == pytest.approx(START if kept else (-3, 3, 1), abs=1e-6)


def test_a_pose_kidnaps_the_model_and_an_internal_error_is_logged(
    node: Any, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    odometry = node.transport.topics["odometry/filtered"]
    odometry.connect()
    assert send(node, "map", (-3.0, 3.0, 1.0)) == (-3.0, 3.0, 1.0)
    node.call("step_world", duration=0.0)
    assert odometry.sent[-1].pose == pytest.approx(START, abs=1e-6)  # It continues.
    assert "initialpose" not in caplog.text

    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("cause")

    monkeypatch.setattr(node.world, "move_model", fail)
    send(node, "map", START)
    [record] = [each for each in caplog.records if each.levelname == "ERROR"]
    assert record.getMessage() == "initialpose: unexpected internal error"
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "cause"
    cancelled: Future[Any] = Future()
    cancelled.cancel()
    done: Future[Any] = Future()
    done.set_result(None)
    caplog.clear()
    for future in (cancelled, done):
        _log_failure(future)
    assert caplog.records == []
