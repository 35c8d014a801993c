"""The warning of lasers of a running world whose frame no TF path connects to the world.

`test_frame_monitor_checks.py` tests when lasers are checked, `tests/ros/test_map_topics.py` the
warning of the node.
"""

from __future__ import annotations

import logging
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

GRACE = 0.1  # s
LISTENING = 0.2  # s
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
    subscribed |= {"/plain_tf/scan", "/plain_static/scan"}
    subscribed |= {"/plain_cycle/scan", "/plain_into_cycle/scan"}
    names = [topic.split("/")[1] for topic in sorted(subscribed)]
    sent = {
        "/tf": {
            "plain_tf_base": "odom",
            "plain_cycle_base": "plain_cycle_eye",
            # The frames of other nodes, which may be those of the world elsewhere.
            "plain_into_cycle_base": "theirs",
            "theirs": "theirs as well",
            "theirs as well": "theirs",
        },
        "/tf_static": {"plain_static_base": "map"},
    }
    when_subscribed(lambda topic, receive: receive(FrameParents(sent[topic])))
    with monitored(*names, "plain_idle", subscribed=subscribed) as state:
        state.wait_until_checked(*subscribed)
        assert state.unchecked == {"/plain_idle/scan"}
        warned = {text.split(" of the scans on ")[1].split(" ")[0] for text in state.warnings}
        assert warned == {"/plain/scan", "/mute/scan", "/plain_cycle/scan"}
        assert len(state.warnings) == 3
        state.world.spawn_model("plain.model.yaml", "late", "late")
        state.world.output("/late/scan")
        subscribed.add("/late/scan")
        state.wait_until_checked("/late/scan")
        assert "/late/scan" in state.warnings[3]
