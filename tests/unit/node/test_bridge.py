"""Outputs and commands of plugins as topics, without ROS."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest

import flatland
from flatland.node.bridge import Bridge
from flatland.node.clock import SimulatedClock
from flatland.node.transport import Adapter

STEP_NS = 5_000_000
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50, enable_odom_tf_pub: true}
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 100,
     angle: {min: 0, max: 1, increment: 1}}
"""
WORLD = "{properties: {}, layers: [{name: 2d}], models: [{name: r, model: robot.model.yaml}]}"


@pytest.fixture
def node(serve: Any, files: Any) -> Any:
    files.write("robot.model.yaml", ROBOT)
    return serve(WORLD, lockstep=True)


def step(node: Any, duration: float) -> None:
    assert node.call("step_world", duration=duration).success


def test_a_value_is_converted_and_published_while_its_topic_has_a_subscriber(
    files: Any, serve: Any, transport: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    converted: list[object] = []
    adapter = Adapter(
        flatland.LaserScan, flatland.LaserScan, lambda value: converted.append(value) or value, None
    )
    find = transport.find_adapter
    monkeypatch.setattr(
        transport,
        "find_adapter",
        lambda kind: adapter if kind is flatland.LaserScan else find(kind),
    )
    files.write("robot.model.yaml", ROBOT)
    node = serve(WORLD, lockstep=True)
    scans = transport.topics["scan"]
    # A part of the program wants the output, so that it is computed without a subscriber.
    values: list[flatland.LaserScan] = []
    node.run(lambda: node.world.output("/scan").subscribe(values.append))
    step(node, 0.02)
    assert len(values) == 2
    assert converted == scans.sent == []
    scans.connect()
    step(node, 0.02)
    assert scans.sent == converted == values[2:]
    scans.connected = False
    step(node, 0.02)
    assert len(values) == 6
    assert len(converted) == len(scans.sent) == 2


def test_an_output_without_a_subscriber_is_not_computed(node: Any) -> None:
    scans, output = node.transport.topics["scan"], node.world.ports.find_output("/scan")
    step(node, 0.02)
    assert output.latest is None
    scans.connect()
    step(node, 0.02)
    assert [scan.stamp for scan in scans.sent] == [4 * STEP_NS, 6 * STEP_NS]
    scans.disconnect()
    step(node, 0.02)
    assert output.latest == scans.sent[-1]


def test_ports_without_an_adapter_are_named(
    serve: Any,
    files: Any,
    transport: Any,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    files.write("robot.model.yaml", ROBOT)
    find = transport.find_adapter
    monkeypatch.setattr(
        transport,
        "find_adapter",
        lambda kind: None if kind in (flatland.LaserScan, flatland.Twist) else find(kind),
    )
    serve(WORLD)
    text = "%s is not connected to ROS: no adapter for %s is registered (register)"
    for port in (('output "/scan"', "LaserScan"), ('command "/cmd_vel"', "Twist")):
        assert text % port in caplog.text


def test_the_last_of_several_commands_is_in_effect(node: Any) -> None:
    receive = node.transport.callbacks["cmd_vel"]
    for number in range(100):
        receive(flatland.Twist(0.0, 0.0, float(number)))
    receive(flatland.Twist(0.0, 0.0, -0.5))
    step(node, 0.1)
    states = node.call("get_model_states", names=["r"]).states
    assert states.velocities[0].tolist() == pytest.approx([0.0, 0.0, -0.5])


def test_the_topic_of_a_deleted_model_is_closed(node: Any) -> None:
    scans = node.transport.topics["scan"]
    scans.connect()
    assert node.call("delete_model", name="r").success
    assert scans.closed
    step(node, 0.02)
    assert scans.sent == []


def test_the_topics_of_a_node_that_ends_are_left_to_the_transport(node: Any) -> None:
    node.close()
    assert not node.transport.topics["scan"].closed


def test_a_model_that_returns_has_topics_of_its_own(files: Any, transport: Any) -> None:
    drive = "plugins: [{type: DiffDrive, name: drive, body: base}]"
    base = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
    bridge = Bridge(transport, SimulatedClock(transport))
    world = files.load_model(f"{base}\n{drive}\n", observers=[bridge])
    before = transport.topics["odometry/filtered"]
    before.connect()
    snapshot = world.snapshot()
    world.delete_model("robot")
    assert before.closed
    world.restore(snapshot)
    after = transport.topics["odometry/filtered"]
    after.connect()
    world.step(2)
    assert len(after.sent) == 2
    assert before.sent == []


def test_the_subscription_of_a_command_ends_with_its_model(files: Any, transport: Any) -> None:
    for ends in (True, False):
        transport.subscriptions.clear()
        bridge = Bridge(transport, SimulatedClock(transport))
        world = files.load_model(ROBOT, observers=[bridge])
        if not ends:
            bridge.close()
        world.delete_model("robot")
        assert [(each.topic, each.closed) for each in transport.subscriptions] == [
            ("cmd_vel", ends)
        ]


def test_a_bridge_needs_a_world(transport: Any) -> None:
    bridge = Bridge(transport, SimulatedClock(transport))
    value: Any = None
    for method in (partial(bridge.command_received, value), bridge.plugin_ros):
        with pytest.raises(RuntimeError, match="the bridge is not attached to a world"):
            method(value)
