"""The warning of lasers whose frame no TF path connects to the world; the world is in this process.

`test_map_topics.py` tests the warning of the node.
"""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from waiting import TIMEOUT, wait_until

import flatland
from flatland.node.frame_monitor import FrameMonitor
from flatland.node.values import FrameParents
from flatland.simulation import Simulation

GRACE = 0.2  # s
LISTENING = 0.5  # s
RATE = 20.0  # Hz
BODIES = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
LASER = "{type: Laser, name: eye, body: base, range: 2, angle: {min: 0, max: 1, increment: 1}"
ROBOTS = {
    "drive": f"[{LASER}}}, {{type: DiffDrive, name: drive, body: base, odom_frame_id: my_odom}}]",
    "world": f"[{LASER}}}, {{type: ModelTfPublisher, name: tf, publish_tf_world: true}}]",
    "fixed": f"[{LASER}, frame: /map, broadcast_tf: false}}]",
    "plain": f"[{LASER}}}]",
    "mute": f"[{LASER}, broadcast_tf: false}}]",
}


def models(*names: str) -> str:
    """Returns a list of models; the kind of a model is the part of its name before `_`."""
    entries = (
        f"  - {{name: {name}, namespace: {name}, model: {name.split('_')[0]}.model.yaml, "
        f"pose: [0, {number - 4}, 0]}}\n"
        for number, name in enumerate(names)
    )
    return "\n" + "".join(entries)


class Monitored:
    """A running world with a monitor."""

    def __init__(self, world: flatland.World, monitor: FrameMonitor, caplog: Any) -> None:
        self.world = world
        self.monitor = monitor
        self.subscribed: set[str] = set()
        self._caplog = caplog

    @property
    def warnings(self) -> list[str]:
        return [
            record.getMessage()
            for record in self._caplog.records
            if "no TF path" in record.getMessage()
        ]

    @property
    def unchecked(self) -> set[str]:
        """Topics of the lasers whose check is not complete."""
        return {output.topic for output in list(self.monitor._checks)}

    def wait_until_checked(self, *topics: str) -> None:
        wait_until(f"checks of {topics}", lambda: not self.unchecked & set(topics))


@pytest.fixture
def monitored(transport: Any, files: Any, caplog: pytest.LogCaptureFixture) -> Callable[..., Any]:
    """Runs a world with some robots and a monitor for the duration of a block."""
    caplog.set_level(logging.WARNING, "flatland")

    @contextmanager
    def run(*names: str, subscribed: set[str] | None = None) -> Iterator[Monitored]:
        for kind, plugins in ROBOTS.items():
            files.write(f"{kind}.model.yaml", f"{BODIES}\nplugins: {plugins}\n")
        world = files.load(f"properties: {{}}\nlayers: []\nmodels: {models(*names)}")
        for output in world.ports.outputs:
            world.output(output)
        simulation = Simulation(world)
        monitor = FrameMonitor(
            transport,
            simulation,
            lambda output: subscribed is None or output.topic in subscribed,
            grace_period=GRACE,
            listening_period=LISTENING,
            rate=RATE,
        )
        thread = threading.Thread(target=simulation.run)
        thread.start()
        try:
            yield Monitored(world, monitor, caplog)
        finally:
            monitor.close()
            simulation.stop()
            thread.join(TIMEOUT)

    return run


@pytest.fixture
def when_subscribed(transport: Any, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Calls a function with the topic and the callback of each subscription."""
    subscribe = transport.subscribe

    def call(action: Callable[[str, Any], object]) -> None:
        def wrapper(topic: str, message_type: Any, callback: Any, **options: Any) -> Any:
            connection = subscribe(topic, message_type, callback, **options)
            action(topic, callback)
            return connection

        monkeypatch.setattr(transport, "subscribe", wrapper)

    return call


def test_only_lasers_without_a_path_cause_a_warning(monitored: Any, when_subscribed: Any) -> None:
    subscribed = {f"/{name}/scan" for name in ("drive", "world", "fixed", "plain", "mute")}
    subscribed |= {"/plain_tf/scan", "/plain_static/scan", "/plain_cycle/scan"}
    names = [topic.split("/")[1] for topic in sorted(subscribed)]
    sent = {
        "/tf": {"plain_tf_base": "odom", "plain_cycle_base": "plain_cycle_eye"},
        "/tf_static": {"plain_static_base": "map"},
    }
    when_subscribed(lambda topic, receive: receive(FrameParents(sent[topic])))
    with monitored(*names, "plain_idle", subscribed=subscribed) as state:
        state.wait_until_checked(*subscribed)
        assert state.unchecked == {"/plain_idle/scan"}
        warned = {text.split(" of the scans on ")[1].split(" ")[0] for text in state.warnings}
        assert warned == {"/plain/scan", "/mute/scan", "/plain_cycle/scan"}
        assert len(state.warnings) == 3


def test_the_warning_names_laser_frame_and_remedy(monitored: Any) -> None:
    with monitored("plain", "mute") as state:
        state.wait_until_checked("/plain/scan", "/mute/scan")
        plain, mute = sorted(state.warnings, key=lambda text: "nothing" in text)
    assert plain == (
        'Model Plugin "eye" type "Laser" model "plain": no TF path leads from frame "plain_eye" of '
        'the scans on /plain/scan to the world (the chain of parents ends at "plain_base"). '
        "Subscribers such as RViz or a costmap cannot transform the scans. Remedy: "
        "enable_odom_tf_pub of a drive or publish_tf_world of a ModelTfPublisher sends the "
        'transform from the world to "plain_base"; so does a localisation'
    )
    assert "(nothing sends the transform of this frame)" in mute
    assert mute.endswith(
        "Remedy: set broadcast_tf of the laser to true, or send the transform by another node"
    )


def test_lasers_are_checked_once(monitored: Any) -> None:
    with monitored("plain") as state:
        state.wait_until_checked("/plain/scan")
        time = state.world.time
        wait_until("some ticks", lambda: state.world.time > time + 0.3)
        assert len(state.warnings) == 1


def test_lasers_of_new_models_are_checked(monitored: Any) -> None:
    with monitored("drive") as state:
        state.wait_until_checked("/drive/scan")
        state.world.spawn_model("plain.model.yaml", "late", "late")
        state.world.output("/late/scan")
        assert state.unchecked == {"/late/scan"}
        state.wait_until_checked("/late/scan")
        assert len(state.warnings) == 1


def test_a_deleted_laser_is_not_checked(monitored: Any) -> None:
    with monitored("plain", subscribed=set()) as state:
        assert state.unchecked == {"/plain/scan"}
        state.world.delete_model("plain")
        assert state.unchecked == set()
        assert state.warnings == []


def is_idle(monitor: FrameMonitor) -> bool:
    return monitor._listener is None


def test_the_time_of_a_pause_does_not_count(monitored: Any, when_subscribed: Any) -> None:
    pauses: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
    # Waits for the function of the world, and pauses it at the first of two subscriptions.
    when_subscribed(lambda topic, _: pauses.get(timeout=TIMEOUT)() if topic == "/tf" else None)
    with monitored("plain") as state:
        pauses.put(state.world.pause)
        wait_until("the end of the listener", lambda: state.world.paused and is_idle(state.monitor))
        assert state.warnings == []
        when_subscribed(lambda _topic, _receive: None)
        state.world.resume()
        state.wait_until_checked("/plain/scan")
        assert len(state.warnings) == 1
