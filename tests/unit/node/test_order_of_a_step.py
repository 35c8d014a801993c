"""The order in which the messages of a step are sent, and messages that cannot be sent."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

import flatland
from flatland.node.bridge import Bridge
from flatland.node.clock import NodeClock
from flatland.runtime.plugin_costs import PluginCosts


class Emitter(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.first = self.output("/first", float)
        self.second = self.output("/second", float)
        self.goal = self.command("goal", float, 0.0, self.accept)

    def accept(self, value):
        if value < 0.0:
            raise ValueError("a negative goal")
        return True

    def before_physics_step(self, timekeeper):
        self.emit(first=1.0, second=2.0)

    def after_physics_step(self, timekeeper):
        self.emit(first=3.0)
        self.send_transform("map", "emitter", 0.0, 0.0, 0.0)

    def emit(self, **numbers):
        for name, number in numbers.items():
            getattr(self, name).emit(number)


WORLD = """
properties: {}
layers: [{name: 2d}]
models: [{name: robot, model: emitter.model.yaml}]
"""
MODEL = """
bodies: [{name: base, footprints: []}]
plugins: [{type: 'test::Emitter', name: emitter}]
"""


class RecordedClock(NodeClock):
    """Records the notifications of the bridge."""

    def __init__(self, log: list[str]) -> None:
        self._log = log

    @property
    def watches_steps(self) -> bool:
        return True

    def step_started(self, time_ns: int) -> None:
        self._log.append(f"start {time_ns // 1_000_000}")

    def time_advanced(self, time_ns: int) -> None:
        self._log.append(f"clock {time_ns // 1_000_000}")


class Setup:
    """A world with a bridge, and the order in which its messages are sent."""

    def __init__(self, world: Any, bridge: Bridge, transport: Any, log: list[str]) -> None:
        self.world = world
        self.bridge = bridge
        self.topics = transport.topics
        self.callbacks = transport.callbacks
        self.log = log
        self.plugin = world.models[0].plugins[0]

    def step(self) -> list[str]:
        """Steps once, and returns what was sent."""
        self.log.clear()
        self.world.step()
        return list(self.log)


@pytest.fixture
def setup(files: Any, transport: Any, declare_plugins: Any) -> Iterator[Setup]:
    """A world whose topics have subscribers."""
    files.write("emitter.model.yaml", MODEL)
    declare_plugins(Emitter)
    log: list[str] = []
    bridge = Bridge(transport, RecordedClock(log))
    world = files.load(WORLD, observers=[bridge], plugin_errors="disable")
    for name, topic in transport.topics.items():

        def publish(message: Any, name: str = name, send: Any = topic.publish) -> None:
            if message == "no number":
                raise TypeError("not a number")
            log.append(name.removeprefix("/"))
            send(message)

        topic.publish = publish
        topic.connect()
    yield Setup(world, bridge, transport, log)
    world.close()


def test_outputs_of_a_step_are_sent_after_its_transforms_in_order(setup: Setup) -> None:
    order = ["start 0", "clock 5", "tf", "first", "second", "first"]
    assert setup.step() == order
    assert setup.step()[1:] == ["clock 10", *order[2:]]
    assert setup.topics["/first"].sent == [1.0, 3.0, 1.0, 3.0]
    assert setup.topics["/second"].sent == [2.0, 2.0]


def test_values_emitted_between_two_steps_are_sent_at_once(setup: Setup) -> None:
    setup.world.post(lambda: setup.plugin.emit(first=7.0))
    setup.world.requests.process()
    assert setup.log == ["first"]
    assert setup.topics["/first"].sent == [7.0]


def test_a_message_that_cannot_be_sent_does_not_affect_the_others(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    def emit(_timekeeper: object) -> None:
        setup.plugin.emit(first="no number", second=8.0)

    (update,) = (each for each in setup.plugin.updates if each.phase == "before")
    update.function = emit
    assert setup.step() == ["start 0", "clock 5", "tf", "second", "first"]
    assert setup.topics["/second"].sent == [8.0]
    assert 'subscriber ROS topic "/first" (adapter ' in caplog.text
    assert 'find_adapter.<locals>.<lambda>) of output "/first" raised' in caplog.text


def test_the_time_of_a_message_is_part_of_the_costs_of_its_plugin(setup: Setup) -> None:
    ticks = iter(range(1000))
    costs = PluginCosts(lambda: float(next(ticks)))
    setup.world.plugin_host.costs = costs
    setup.step()
    # Two hooks and three messages, each from one tick to the next.
    assert costs.seconds == {setup.plugin: 5.0}
    setup.world.plugin_host.costs = None
    setup.step()
    assert costs.seconds == {setup.plugin: 5.0}


def test_messages_set_a_command_until_its_plugin_is_closed(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    receive = setup.callbacks["goal"]
    for value in (1.5, -1.0):
        receive(value)
        setup.world.requests.process()
        assert setup.plugin.goal.value == 1.5
    assert 'command "/goal" raised' in caplog.text
    assert "a negative goal" in caplog.text
    receive(2.0)
    setup.world.delete_model("robot")
    setup.world.requests.process()
    assert caplog.text.count("raised") == 1


def test_messages_of_an_output_that_is_closed_within_a_step_are_sent(setup: Setup) -> None:
    """As when a model with an invalid pose is removed."""

    def emit_and_close(_timekeeper: object) -> None:
        setup.plugin.emit(first=9.0)
        setup.bridge.output_closed(setup.plugin.first)

    (update,) = (each for each in setup.plugin.updates if each.phase == "before")
    update.function = emit_and_close
    assert setup.step() == ["start 0", "first", "clock 5", "tf"]
    assert setup.topics["/first"].sent == [9.0]
    assert setup.topics["/first"].closed
