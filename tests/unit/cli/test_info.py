"""`flatland info`."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from flatland_command import main

from flatland.cli.info import frame_tree

ROBOT = """
bodies:
- name: base
  footprints: [{type: circle, radius: 0.5, density: 2, layers: [walls]}]
- {name: arm, pose: [1, 0, 0], footprints: [{type: circle, radius: 0.1, density: 0}]}
joints: [{type: weld, name: j, bodies: [{name: base, anchor: [1, 0]}, {name: arm, anchor: [0, 0]}]}]
plugins:
- {type: DiffDrive, name: drive, body: base, pub_rate: 20}
- {type: Laser, name: eye, body: arm, range: 9, angle: {min: 0, max: 6, increment: 0.1}}
- {type: ModelTfPublisher, name: tf, update_rate: 10}
"""


@pytest.fixture
def robot_world(files: Any) -> str:
    """A room with a robot in a namespace."""
    files.write_map("room", ["....", ".##.", "...."])
    files.write("robot.model.yaml", ROBOT)
    return files.write(
        "world.yaml",
        """
        properties: {}
        layers: [{name: [walls, low], map: room.yaml}, {name: empty}]
        models: [{name: robot, model: robot.model.yaml, namespace: r1, pose: [9, 1, 0.5]}]
        """,
    )


def info(path: str, capsys: Any) -> dict[str, Any]:
    assert main("info", path, "--json") == 0
    contents: dict[str, Any] = json.loads(capsys.readouterr().out)
    return contents


def test_layers_and_models(robot_world, capsys):
    contents = info(robot_world, capsys)
    assert contents["file"] == robot_world
    walls, empty = contents["layers"]
    bounds = [1.0, 1.0, 3.0, 2.0]
    assert walls == {"names": ["walls", "low"], "edges": 4, "exact_edges": 4, "bounds": bounds}
    assert (empty["edges"], empty["bounds"]) == (0, None)
    (model,) = contents["models"]
    assert (model["name"], model["namespace"], model["pose"]) == ("robot", "r1", [9, 1, 0.5])
    base, arm = model["bodies"]
    assert base["mass"] == pytest.approx(2 * math.pi * 0.25, rel=1e-4)
    assert base["layers"] == ["walls"]
    assert arm["layers"] == ["all"]
    assert model["mass"] == pytest.approx(base["mass"] + arm["mass"], rel=1e-4)
    assert model["joints"] == [{"name": "j", "type": "weld", "bodies": ["base", "arm"]}]
    assert [(p["name"], p["type"], p["rate"]) for p in model["plugins"]] == [
        ("drive", "DiffDrive", 20),
        ("eye", "Laser", 200),  # in every step
        ("tf", "ModelTfPublisher", 10),
    ]


def test_the_poses_are_those_of_the_file(files, capsys):
    """The body moves in the steps that are needed to find the frames."""
    tween = "{type: Tween, name: t, body: base, delta: [5, 0, 0], duration: 0.01}"
    files.write("m.yaml", f"bodies: [{{name: base, footprints: []}}]\nplugins: [{tween}]")
    models = "[{name: m, model: m.yaml, pose: [1, -0.0, -0.00001]}]"
    path = files.write("w.yaml", f"{{properties: {{}}, layers: [], models: {models}}}")
    assert main("info", path) == 0
    assert "  m      1 0 0 " in capsys.readouterr().out


def test_topics_and_frames(robot_world, capsys):
    contents = info(robot_world, capsys)
    topics = {topic["topic"]: topic for topic in contents["topics"]}
    scan = {"topic": "/r1/scan", "direction": "out", "type": "LaserScan", "rate": 200}
    scan |= {"message": "sensor_msgs/LaserScan", "plugins": ["robot/eye"]}
    assert topics["/r1/scan"] == scan
    assert topics["/r1/cmd_vel"]["direction"] == "in"
    assert topics["/r1/cmd_vel"]["message"] == "geometry_msgs/Twist"
    assert topics["/r1/odometry/filtered"]["rate"] == 20
    frames = {(frame["parent"], frame["child"]) for frame in contents["frames"]}
    assert {("odom", "r1_base"), ("r1_base", "r1_arm")} <= frames


def test_text(robot_world, capsys):
    assert main("info", robot_world) == 0
    text = capsys.readouterr().out
    rows = {" ".join(line.split()) for line in text.splitlines()}
    assert "robot/base dynamic 1.571 0.1963 1 walls" in rows
    assert "/r1/scan out LaserScan sensor_msgs/LaserScan 200 robot/eye" in rows
    assert "  odom\n    r1_base\n      r1_arm\n" in text
    assert "spawn_model flatland/SpawnModel" in rows


def test_frames_and_rates_of_plugins_that_publish_after_the_step(files, capsys):
    robot = ROBOT.replace("pub_rate: 20", "pub_rate: 20, after_step: true")
    path = files.write("robot.model.yaml", robot.replace("rate: 10}", "rate: 4, after_step: true}"))
    contents = info(path, capsys)
    frames = {(frame["parent"], frame["child"]) for frame in contents["frames"]}
    assert frames == {("odom", "base"), ("base", "arm"), ("arm", "eye")}
    rates = {topic["topic"]: topic["rate"] for topic in contents["topics"]}
    assert rates["/odometry/filtered"] == 20


def test_a_model(files, capsys):
    path = files.write("robot.model.yaml", ROBOT)
    contents = info(path, capsys)
    assert [model["name"] for model in contents["models"]] == ["robot"]
    assert contents["layers"] == []


def test_an_invalid_file_is_an_error(files, capsys):
    assert main("info", files.write("w.yaml", "{properties: {}, layers: 7}")) == 1
    assert '"layers" must be a list' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("pairs", "lines"),
    [
        ([], ["none"]),
        ([("b", "c"), ("a", "b"), ("a", "d")], ["a", "  b", "    c", "  d"]),
        ([("a", "c"), ("b", "c")], ["a", "  c", "b", "  c"]),
        ([("a", "b"), ("b", "a")], ["a", "  b", "    a (cycle)"]),
    ],
)
def test_frame_tree(pairs, lines):
    assert frame_tree(pairs) == lines
