"""`~if_blocked`: responses of services that place a model at a blocked pose, without ROS."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

WORLD = """
properties: {}
layers: [{name: 2d, map: map.yaml}]
models: [{name: first, model: ball.model.yaml, pose: [3, 3, 0]}]
"""
MAP = "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [0, 0, 0]\n"
WALLS = "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n"  # a room of 10 m by 10 m around (0, 0)
BALL = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]\n"
SPAWN = 'model "second" overlaps model "first" at (3.100, 3.000, 0.500)'
MOVE = 'model "second" overlaps model "first" at (2.700, 3.000, 0.000)'


@pytest.fixture
def start(serve: Any, files: Any) -> Any:
    for name, text in {"map.yaml": MAP, "walls.dat": WALLS, "ball.model.yaml": BALL}.items():
        files.write(name, text)
    return lambda **parameters: serve(WORLD, lockstep=True, **parameters)


def pose(x: float, y: float, theta: float = 0.0) -> SimpleNamespace:
    return SimpleNamespace(x=x, y=y, theta=theta)


def spec(name: str, x: float, y: float, theta: float = 0.0) -> Any:
    return SimpleNamespace(yaml_path="ball.model.yaml", name=name, ns="", pose=pose(x, y, theta))


def spawn(node: Any, *arguments: Any, **options: Any) -> tuple[bool, str]:
    answer = node.call("spawn_model", **vars(spec(*arguments, **options)))
    return answer.success, getattr(answer, "message", "")


def move(node: Any, name: str, *place: float) -> tuple[bool, str]:
    answer = node.call("move_model", name=name, pose=pose(*place))
    return answer.success, getattr(answer, "message", "")


def pose_of(node: Any, name: str) -> Any:
    return node.call("get_model_states", names=[name]).states.poses[0].tolist()


@pytest.mark.parametrize("choice", [None, "allow", "warn"])
def test_the_model_is_put_at_a_blocked_pose(
    start: Any, caplog: pytest.LogCaptureFixture, choice: str | None
) -> None:
    node = start() if choice is None else start(if_blocked=choice)
    assert spawn(node, "second", 3.1, 3, 0.5) == (True, "")
    assert pose_of(node, "second") == pytest.approx([3.1, 3, 0.5])
    assert move(node, "second", 2.7, 3) == (True, "")
    assert pose_of(node, "second") == pytest.approx([2.7, 3, 0])
    warnings = [each.message for each in caplog.records if "overlaps" in each.message]
    if choice == "allow":
        assert warnings == []
    else:
        assert [text in warning for text, warning in zip((SPAWN, MOVE), warnings, strict=True)]


def test_refused_models_are_not_placed(start: Any) -> None:
    node = start(if_blocked="refuse")
    text = SPAWN.replace('"second" overlaps', '"second", it overlaps')
    assert spawn(node, "second", 3.1, 3, 0.5) == (False, f"Flatland World: failed to spawn {text}")
    assert [model.name for model in node.world.models] == ["first"]
    assert spawn(node, "second", 1, 1) == (True, "")
    text = MOVE.replace('"second" overlaps', '"second", it overlaps')
    assert move(node, "second", 2.7, 3) == (False, f"Flatland World: failed to move {text}")
    assert pose_of(node, "second") == [1, 1, 0]


def test_nearest_reports_the_chosen_pose(start: Any) -> None:
    node = start(if_blocked="nearest")
    success, message = spawn(node, "2", 3.1, 3, 0.5)
    assert success
    # Two discs of radius 0.2 m, at first 0.1 m apart, must be 0.4 m apart.
    x, y, theta = pose_of(node, "2")
    away = math.dist((x, y), (3.1, 3))
    assert (away, math.dist((x, y), (3, 3))) == pytest.approx((0.3, 0.4), abs=0.006)
    assert theta == pytest.approx(0.5)
    assert message == (
        'the requested pose is blocked: model "2" was put at '
        f"({x:.3f}, {y:.3f}, 0.500), {away:.3f} m away"
    )
    success, message = move(node, "first", 4.9, 0)
    assert success
    assert 'model "first" was put at (4.800, 0.000, 0.000), 0.100 m away' in message
    assert move(node, "2", 0, 0) == (True, "")


def test_nearest_places_of_several_models(start: Any) -> None:
    node = start(if_blocked="nearest")
    answer = node.call("spawn_models", models=[spec(f"b{i}", 0, 0) for i in range(3)])
    assert answer.success
    assert answer.message.count("the requested pose is blocked") == 2
    assert 'model "b2" was put at' in answer.message
    assert answer.poses[0] == (0, 0, 0)
    assert len(set(answer.poses)) == 3
