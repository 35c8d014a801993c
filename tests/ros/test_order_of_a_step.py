"""The order in which the messages of a step are sent: `/clock`, `/tf`, outputs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from raw_subscriber import RawSubscriber
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage
from waiting import TIMEOUT

import flatland
from flatland.ros.bridge import Bridge
from flatland.ros.transport.outbox import Outbox
from flatland.ros.transport.registrar import Registrar
from flatland.runtime.plugin_costs import PluginCosts

ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 50,
     angle: {min: -1.5, max: 1.5, increment: 0.01}}
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50}
  - {type: ModelTfPublisher, name: tf, publish_tf_world: true, update_rate: 50}
"""
NEEDED = {("odom", "base"), ("map", "base"), ("base", "laser")}


def test_transforms_and_the_clock_of_a_scan_are_received_before_it(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    """What was sent before a scan can be read when the scan can, since all is on one machine."""
    world = write_world("[{name: robot, model: robot.model.yaml}]", robot=ROBOT)
    launcher.server(world)
    scans, tf, clock = (
        RawSubscriber(ros.master, *topic)
        for topic in (("/scan", LaserScan), ("/tf", TFMessage), ("/clock", Clock))
    )
    # From here on, all three are connected.
    last_time = clock.next().clock
    last_transform = max(each.header.stamp for each in tf.next().transforms)
    frames: defaultdict[Any, set[tuple[str, str]]] = defaultdict(set)
    late = []
    stamp = scans.next().header.stamp
    while stamp <= last_transform:
        stamp = scans.next().header.stamp
    for _ in range(40):
        stamp = scans.next().header.stamp
        # Several scans may have arrived, and the transforms of all of them.
        for message in tf.received():
            for each in message.transforms:
                frames[each.header.stamp].add((each.header.frame_id, each.child_frame_id))
        for message in clock.received():
            last_time = message.clock
        if not (frames[stamp] >= NEEDED and last_time >= stamp):
            late.append((stamp, frames[stamp], last_time))
    assert late == []
    for subscriber in (scans, tf, clock):
        subscriber.close()


# -- the bridge in this process ---------------------------------------------------------------


EMITTER = """
from std_msgs.msg import Float32

import flatland
from flatland.ros.adapters import register_adapter


class Reading:
    def __init__(self, number):
        self.number = number


register_adapter(Reading, Float32, lambda value: Float32(value.number))


class Emitter(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.first = self.output("/flatland_tests/first", Reading)
        self.second = self.output("/flatland_tests/second", Reading)

    def before_physics_step(self, timekeeper):
        self.emit(first=1.0, second=2.0)

    def after_physics_step(self, timekeeper):
        self.emit(first=3.0)
        self.send_transform("map", "emitter", 0.0, 0.0, 0.0)

    def emit(self, **numbers):
        for name, number in numbers.items():
            getattr(self, name).emit(Reading(number))
"""
MANIFEST = """
<library path=".">
  <class name="Emitter" type="order_plugin.Emitter" base_class_type="flatland::ModelPlugin"/>
</library>
"""


class RecordedClock:
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

    def close(self) -> None:
        pass


class Setup:
    """A world with a bridge, and the order in which its messages are sent."""

    def __init__(self, world: Any, log: list[str], topics: list[Any], plugin: Any) -> None:
        self.world = world
        self.log = log
        self.first, self.second, self.tf = topics
        self.plugin = plugin

    def step(self) -> list[str]:
        """Steps once, and returns what was sent."""
        self.log.clear()
        self.world.step()
        return list(self.log)


@pytest.fixture
def setup(
    ros: Any,
    write_world: Callable[..., Path],
    monkeypatch: pytest.MonkeyPatch,
    eventually: Callable[..., Any],
) -> Iterator[Setup]:
    """A world in this process, with subscribers of all of its topics."""
    log: list[str] = []
    write = Outbox.write

    def record(outbox: Outbox, data: bytes) -> None:
        log.append(outbox.topic.rpartition("/")[2])
        write(outbox, data)

    monkeypatch.setattr(Outbox, "write", record)
    path = write_world(
        "[{name: robot, model: emitter.model.yaml}]",
        emitter="bodies: [{name: base, footprints: []}]\n"
        "plugins: [{type: Emitter, name: emitter}]\n",
    )
    (path.parent / "order_plugin.py").write_text(EMITTER)
    (path.parent / "manifest.xml").write_text(MANIFEST)
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", str(path.parent / "manifest.xml"))
    registrar = Registrar()
    bridge = Bridge(registrar, RecordedClock(log))
    world = flatland.World.from_yaml(path, observers=[bridge], plugin_errors="disable")
    assert registrar.flush(TIMEOUT)
    topics = [
        ros.topic("/flatland_tests/first", Float32),
        ros.topic("/flatland_tests/second", Float32),
        ros.topic("/tf", TFMessage),
    ]
    plugin = world.models[0].plugins[0]
    eventually("connections", lambda: bridge.wants_transforms and plugin.second.wanted)
    eventually("a connection", lambda: plugin.first.wanted)
    yield Setup(world, log, topics, plugin)
    world.close()
    assert registrar.flush(TIMEOUT)
    registrar.close(TIMEOUT)


def test_outputs_of_a_step_are_sent_after_its_transforms_in_order(setup: Setup) -> None:
    order = ["start 0", "clock 5", "tf", "first", "second", "first"]
    assert setup.step() == order
    assert setup.step()[1:] == ["clock 10", *order[2:]]
    assert [message.data for message in setup.first.take(4)] == [1.0, 3.0, 1.0, 3.0]
    assert [message.data for message in setup.second.take(2)] == [2.0, 2.0]


def test_values_emitted_between_two_steps_are_sent_at_once(setup: Setup) -> None:
    setup.log.clear()
    setup.world.post(lambda: setup.plugin.emit(first=7.0))
    setup.world.requests.process()
    assert setup.log == ["first"]
    assert setup.first.next().data == 7.0


def test_a_message_that_cannot_be_sent_does_not_affect_the_others(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    def emit(_timekeeper: object) -> None:
        setup.plugin.emit(first="no number", second=8.0)

    setup.plugin.before_physics_step = emit
    setup.world.plugin_host.hooks.wrap(None)
    assert setup.step() == ["start 0", "clock 5", "tf", "second", "first"]
    assert setup.second.next().data == 8.0
    assert 'subscriber ROS topic "/flatland_tests/first"' in caplog.text
    assert 'of output "/flatland_tests/first" raised' in caplog.text


def test_the_time_of_a_message_is_part_of_the_costs_of_its_plugin(setup: Setup) -> None:
    ticks = iter(range(1000))
    costs = PluginCosts(lambda: float(next(ticks)))
    setup.world.plugin_host.measure(costs)
    setup.step()
    # Two hooks and three messages, each from one tick to the next.
    assert costs.seconds == {setup.plugin: 5.0}
    setup.world.plugin_host.measure(None)
    setup.step()
    assert costs.seconds == {setup.plugin: 5.0}
