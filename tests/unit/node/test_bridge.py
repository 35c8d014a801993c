"""Outputs and commands of plugins as topics, without ROS."""

from __future__ import annotations

from typing import Any

import pytest

import flatland
from flatland.node.bridge import Bridge
from flatland.node.clock import SimulatedClock

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


def test_a_value_is_published_while_its_topic_has_a_subscriber(node: Any) -> None:
    scans = node.transport.topics["scan"]
    # A part of the program wants the output, so that it is computed without a subscriber.
    values: list[flatland.LaserScan] = []
    node.run(lambda: node.world.output("/scan").subscribe(values.append))
    converted: list[object] = []
    topic = node.served._bridge._outputs[node.world.output("/scan")]
    topic._convert = lambda value: converted.append(value) or value
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
    scans = node.transport.topics["scan"]
    output, bridge = node.world.ports.find_output("/scan"), node.served._bridge
    step(node, 0.02)
    assert not bridge.subscribed(output)
    scans.connect()
    assert bridge.subscribed(output)
    step(node, 0.02)
    assert [scan.stamp for scan in scans.sent] == [4 * STEP_NS, 6 * STEP_NS]


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


def test_messages_between_two_steps_are_published_at_once(files: Any, transport: Any) -> None:
    bridge = Bridge(transport, SimulatedClock(transport))
    published: list[str] = []
    bridge._send(published.append, "without a world")
    with pytest.raises(RuntimeError, match="the bridge is not attached to a world"):
        bridge._post(lambda: None)
    plugin: Any = None
    with pytest.raises(RuntimeError, match="the bridge is not attached to a world"):
        bridge.plugin_ros(plugin)
    world = files.load_model(ROBOT, observers=[bridge])
    bridge.step_started()
    bridge._send(published.append, "in a step")
    assert published == ["without a world"]
    bridge.step_finished()
    assert published == ["without a world", "in a step"]
    bridge._send(published.append, "after it")
    assert published[2:] == ["after it"]
    bridge.step_finished()
    assert published[3:] == []
    # What a plugin is given.
    (plugin, *_) = world.model("robot").plugins
    access = bridge.plugin_ros(plugin)
    assert access._plugin is plugin
    assert access._transport is transport
    assert access._requests is world.requests
    assert access._post == bridge._post
    assert not access._shutting_down()
    bridge.close()
    assert access._shutting_down()


def test_the_subscription_of_a_command_ends_with_its_model(
    files: Any, transport: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    subscribers: list[Any] = []
    subscribe = transport.subscribe

    def record(*arguments: Any, **options: Any) -> Any:
        subscribers.append(subscribe(*arguments, **options))
        return subscribers[-1]

    monkeypatch.setattr(transport, "subscribe", record)
    for ends in (True, False):
        bridge = Bridge(transport, SimulatedClock(transport))
        world = files.load_model(ROBOT, observers=[bridge])
        if not ends:
            bridge.close()
        world.delete_model("robot")
        assert [each.closed for each in subscribers] == [ends]
        subscribers.clear()


def test_a_failing_topic_is_named_with_its_adapter(files: Any, transport: Any) -> None:
    bridge = Bridge(transport, SimulatedClock(transport))
    world = files.load_model(ROBOT, observers=[bridge])
    topic = bridge._outputs[world.output("/scan")]

    def convert(value: Any) -> Any:
        return value

    topic._convert = convert
    name = f"{__name__}.{convert.__qualname__}"
    assert repr(topic) == f'ROS topic "scan" (adapter {name})'
