"""Resets: the state is exactly that after loading, and what is connected stays connected."""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from observations import observations

import flatland
from flatland import PluginError, StaleHandleError, Twist, World, WorldError, YamlError

WORLD = """
properties: {velocity_iterations: 8}
layers:
  - {name: walls, map: room.yaml}
  - {name: other, map: $eval math.random() < 0.5 and "room.yaml" or "hall.yaml"}
models:
  - name: robot
    model: robot.model.yaml
    pose: [$eval 2 + math.random(), 4, 0.3]
  - {name: second, model: robot.model.yaml, pose: [6, $eval 3 + param("offset"), 1], namespace: b}
  - {name: box, model: minimal.model.yaml, pose: [5, 5.5, 0]}
plugins:
  - {type: RandomWall, name: walls, layer: walls, robot_name: robot, num_of_walls: 3}
"""
ROBOT = """
bodies:
  - name: base
    footprints: [{type: circle, radius: $eval 0.2 + 0.1 * math.random(), density: 1}]
plugins:
  - $include drive.yaml
  - {type: Laser, name: laser, body: base, range: 5, update_rate: 10, noise_std_dev: 0.1,
     angle: {min: -1, max: 1, increment: 0.1}}
  - {type: Bumper, name: bumper}
  - {type: Sonar, name: sonar, body: base, range: 5, update_rate: 10, noise_std_dev: 0.1,
     field_of_view: 0.2}
  - {type: SemanticScan, name: labels, body: base, range: 5, update_rate: 10, noise_std_dev: 0.1,
     angle: {min: -1, max: 1, increment: 0.5}}
  - {type: WheelStates, name: wheels, update_rate: 10, wheels: [{name: left, radius: 0.1}]}
  - {type: PosePublisher, name: pose, update_rate: 10}
  - {type: Hitch, name: hitch, reach: 3, start: true, update_rate: 10}
"""
DRIVE = "{type: DiffDrive, name: drive, body: base, odom_drift: [0.1, 0.1, 0.1, 0.1]}"


@pytest.fixture
def params() -> dict[str, object]:
    return {"offset": 0.25}


@pytest.fixture
def world(files: Any, params: dict[str, object]) -> Iterator[World]:
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write_map("hall", ["##########", *["#........#"] * 7, "#....#...#", "##########"])
    files.write("robot.model.yaml", ROBOT)
    files.write("drive.yaml", DRIVE)
    return files.load(WORLD, params=params)


def fresh(world: World, seed: int) -> World:
    return World.from_yaml(world.path, seed=seed, params={"offset": 0.25})


def use(world: World) -> None:
    """Does all kinds of things with a world."""
    world.command("/cmd_vel").set(Twist(linear_x=1.0, angular_z=0.5))
    world.step(100)
    world.delete_model("second")
    world.spawn_model("minimal.model.yaml", "newer", pose=(3.0, 3.0, 0.0))
    world.move_model("box", (7.0, 7.0, 0.0))
    world.sample_free(2, 0.1)
    world.step(100)


def run(world: World) -> list[object]:
    world.command("/cmd_vel").set(Twist(linear_x=1.0, angular_z=0.3))
    world.command("/b/cmd_vel").set(Twist(linear_x=-1.0, angular_z=0.3))
    topics = ("scan", "range", "semantic_scan", "joint_states", "pose", "hitched")
    for topic in topics:
        world.output(f"/b/{topic}")
    return [*observations(world), world.sample_free(2, 0.1).tolist()]


@pytest.mark.parametrize("seed", [None, 7])
def test_the_state_is_that_after_loading(world: World, seed: int | None) -> None:
    with fresh(world, 1 if seed is None else seed) as other:
        first = world.state_hash()
        expected_hash = other.state_hash()
        assert (first == expected_hash) == (seed is None)
        expected = run(other)
        for _ in range(2):
            use(world)
            world.reset(seed)
            assert (world.time, world.seed) == (0.0, other.seed)
            assert world.state_hash() == expected_hash
            assert run(world) == expected


def test_the_time_can_continue(world: World) -> None:
    stamps: list[int] = []
    world.output("/scan").subscribe(lambda scan: stamps.append(scan.stamp))
    world.step(130)
    world.reset(keep_time=True)
    assert world.time == pytest.approx(0.65)
    world.step(71)
    assert stamps == [number * 100_000_000 for number in range(11)]


def test_files_and_parameters_are_not_read_again(
    world: World, params: dict[str, object], files: Any
) -> None:
    before, files_before = world.state_hash(), list(world.source.inputs.files)
    params.clear()
    for path in Path(files.folder).iterdir():
        path.unlink()
    world.reset()
    assert world.state_hash() == before
    assert list(world.source.inputs.files) == files_before
    with pytest.raises(YamlError, match="File does not exist"):
        world.spawn_model("minimal.model.yaml", "newer")


def test_what_is_connected_stays_connected(world: World, log: Any) -> None:
    world.add_observer(log)
    world.spawn_model("robot.model.yaml", "newer", "newer", (7.0, 2.0, 0.0))
    received: list[Any] = []
    output, topic = world.output("/scan"), world.command("/cmd_vel")
    output.subscribe(received.append)
    commands = [command for same in world.ports.commands.values() for command in same]
    layers = world.layers[:]
    topic.set(Twist(linear_x=1.0))
    world.step(30)
    log.events.clear()
    world.reset()
    ports = [event for event in log.events if not event.startswith(("model_", "layer_"))]
    assert all(re.fullmatch(r"\w+_closed /newer/.*", event) for event in ports)
    assert len(ports) == 12
    assert world.output("/scan") is output
    assert not output.closed
    assert output.latest is None
    assert (topic.value, commands[0].received, commands[0].closed) == (Twist(), 0, False)
    assert world.ports.commands["/cmd_vel"] == commands[:1]
    assert world.layers == layers
    assert layers[0].body.entity is layers[0]
    received.clear()
    topic.set(Twist(linear_x=1.0))
    world.step(1)
    assert len(received) == 1
    assert world.model("robot").bodies[0].velocity[0] != 0.0


def test_models_bodies_and_plugins_are_new(world: World) -> None:
    robot = world.model("robot")
    body, plugin = robot.bodies[0], robot.plugin("drive")
    world.reset()
    assert world.model("robot").plugin("drive") is not plugin
    for old in (body, robot):
        with pytest.raises(StaleHandleError):
            _ = old.pose


def test_a_command_that_was_not_carried_out_does_not_survive_its_plugin(world: World) -> None:
    world.command("/cmd_vel").set(Twist(linear_x=1.0))
    world.reset()
    world.step(10)
    world.command("/cmd_vel").set(Twist(linear_x=1.0))
    world.command("/b/cmd_vel").set(Twist(linear_x=1.0))
    world.delete_model("robot")
    world.step(10)
    state = world.state()
    vx, vy, _ = state.velocities[state.names.index("second")]
    assert math.hypot(vx, vy) == pytest.approx(1.0, abs=0.01)


def test_a_command_of_another_type_is_not_kept(world: World, files: Any) -> None:
    world.delete_model("robot")
    files.write(
        "switch.model.yaml",
        """
        bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
        plugins: [{type: Tween, name: t, body: base, mode: trigger, trigger_topic: cmd_vel}]
        """,
    )
    world.spawn_model("switch.model.yaml", "switch", pose=(2.0, 2.0, 0.0))
    command = world.ports.commands["/cmd_vel"][0]
    world.reset()
    assert command.closed
    world.command("/cmd_vel").set(Twist(linear_x=1.0))


def test_a_reset_that_a_hook_requests_takes_effect_after_the_step(world: World) -> None:
    expected = world.state_hash()
    unsubscribe = world.output("/scan").subscribe(lambda _: world.reset())
    world.step()
    assert world.state_hash() == expected
    unsubscribe()


def test_requests_and_the_pause_remain(world: World) -> None:
    world.step(10)
    world.pause()
    world.reset()
    assert world.paused
    world.resume()
    calls: list[int] = []
    world.post(lambda: calls.append(1))
    world.reset()
    world.step()
    assert calls == [1]


class Failing(flatland.ModelPlugin):
    def on_initialize(self, config):
        config.get("number", "float")
        if self.world.seed == 13:
            raise ValueError("unlucky")
        if config.get("uncopyable", "bool", False):
            self.numbers = (number for number in range(3))


@pytest.fixture
def failing(declare_plugins: Any) -> None:
    declare_plugins(Failing)


def failing_world(files: Any, options: str = "") -> World:
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write("drive.yaml", DRIVE)
    files.write(
        "failing.model.yaml",
        f"""
        bodies: [{{name: base, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}]
        plugins: [{{type: 'test::Failing', name: failing, number: 1{options}}}, $include drive.yaml]
        """,
    )
    world: World = files.load(
        """
        properties: {}
        layers: [{name: walls, map: room.yaml}]
        models:
          - {name: box, model: minimal.model.yaml, pose: [5, 5.5, 0]}
          - {name: robot, model: failing.model.yaml, pose: [2, 2, 0]}
        """
    )
    return world


def test_a_reset_that_fails_changes_nothing(files: Any, failing: None) -> None:
    world = failing_world(files)
    output, robot, layer = world.output("/odometry/filtered"), world.model("robot"), world.layers[0]
    received: list[Any] = []
    output.subscribe(received.append)
    world.command("/cmd_vel").set(Twist(linear_x=0.3))
    world.step(20)
    with world.clone() as clone:
        before, count = world.state_hash(), len(received)
        with pytest.raises(PluginError, match="unlucky"):
            world.reset(seed=13)
        assert world.state_hash() == before
        assert (world.seed, world.model("robot"), world.layers) == (1, robot, [layer])
        assert world.output("/odometry/filtered") is output
        world.step(50)
        clone.step(50)
        assert world.state_hash() == clone.state_hash()
        assert len(received) == count + 50
    world.reset(seed=3)


def test_a_reset_that_fails_with_an_uncopyable_plugin_leaves_an_empty_world(
    files: Any, failing: None, caplog: pytest.LogCaptureFixture
) -> None:
    world = failing_world(files, ", uncopyable: true")
    with caplog.at_level(logging.ERROR), pytest.raises(PluginError, match="unlucky"):
        world.reset(seed=13)
    assert world.models == []
    assert "the world is empty" in caplog.text
    world.step()
    world.reset(seed=2)
    assert [model.name for model in world.models] == ["box", "robot"]


def test_errors(world: World) -> None:
    with pytest.raises(WorldError, match="only a world that was loaded from a file can be reset"):
        World().reset()
    with pytest.raises(ValueError, match="seed must be an integer of at least 0, got -2"):
        world.reset(seed=-2)
    with world.clone() as clone:
        use(clone)
        clone.reset()
        assert clone.state_hash() == world.state_hash()
    world.close()
    with pytest.raises(WorldError, match="the world is closed"):
        world.reset()
