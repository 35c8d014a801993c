"""The warning of lasers whose frame no TF path connects to the world."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from waiting import wait_until

import flatland
from flatland.node import frame_monitor
from flatland.node.frame_monitor import FrameMonitor
from flatland.node.values import FrameParents

GRACE, LISTENING = 1.0, 2.0  # s
BODIES = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
LASER = "{type: Laser, name: eye, body: base, range: 2, angle: {min: 0, max: 1, increment: 1}"
ROBOTS = {
    "drive": f"[{LASER}}}, {{type: DiffDrive, name: drive, body: base, odom_frame_id: my_odom}}]",
    "world": f"[{LASER}}}, {{type: ModelTfPublisher, name: tf, publish_tf_world: true}}]",
    "fixed": f"[{LASER}, frame: /map, broadcast_tf: false}}]",
    "plain": f"[{LASER}}}]",
    # Two lasers with the same frame and topic.
    "mute": f"[{LASER}, broadcast_tf: false}}, "
    f"{LASER.replace('eye', 'ear')}, broadcast_tf: false, frame: eye}}]",
}


class Setup:
    """A world of some robots, and a monitor whose ticks are those of the test.

    Attributes:
        idle: Topics of lasers without a subscriber.
        posted: Ticks that the monitor has requested by itself.
    """

    def __init__(self, world: flatland.World, transport: Any, monkeypatch: Any) -> None:
        self.world = world
        self.transport = transport
        self.now = 100.0
        self.idle: set[str] = set()
        self.posted: list[Any] = []
        monkeypatch.setattr(frame_monitor, "time", SimpleNamespace(monotonic=lambda: self.now))
        simulation: Any = SimpleNamespace(world=world, post=self.posted.append)
        self.monitor = FrameMonitor(
            transport,
            simulation,
            lambda output: output.topic not in self.idle,
            grace_period=GRACE,
            listening_period=LISTENING,
        )

    def tick(self, seconds: float) -> bool:
        """Ticks some time after the previous tick [s]; returns whether there are checks left."""
        self.now += seconds
        return self.monitor._tick(self.now)

    @property
    def listening(self) -> set[str]:
        """The topics to which the monitor subscribes."""
        return {each.topic for each in self.transport.subscriptions if not each.closed}


@pytest.fixture
def start(transport: Any, files: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Starts a monitor of models, the part of whose names before `_` is their kind."""
    started: list[Setup] = []

    def start(*names: str) -> Setup:
        for kind, plugins in ROBOTS.items():
            files.write(f"{kind}.model.yaml", f"{BODIES}\nplugins: {plugins}\n")
        world = files.load("{properties: {}, layers: []}")
        for number, name in enumerate(names):
            path = f"{name.split('_')[0]}.model.yaml"
            world.spawn_model(path, name, name, (0.0, float(number), 0.0))
            world.output(f"/{name}/scan")
        started.append(Setup(world, transport, monkeypatch))
        world.step()
        return started[-1]

    yield start
    for setup in started:
        setup.monitor.close()


@pytest.fixture
def warnings(caplog: pytest.LogCaptureFixture) -> Callable[[], list[str]]:
    """Returns the texts of the warnings so far, without anything else in the log."""

    def texts() -> list[str]:
        assert {record.levelname for record in caplog.records} <= {"WARNING"}
        return [record.getMessage() for record in caplog.records]

    return texts


def test_lasers_without_a_path_are_named_after_both_periods(start: Any, warnings: Any) -> None:
    setup = start("mute", "plain")
    assert setup.tick(0.0)
    assert setup.tick(GRACE - 0.1)
    assert setup.listening == set()
    assert setup.tick(0.1)
    assert setup.listening == {"/tf", "/tf_static"}
    assert setup.tick(LISTENING - 0.1)
    assert warnings() == []
    assert not setup.tick(0.1)
    assert setup.listening == set()
    rest = "Subscribers such as RViz or a costmap cannot transform the scans. Remedy: "
    assert warnings() == [
        'Model Plugin "eye" type "Laser" model "mute" and Model Plugin "ear" type "Laser" model '
        '"mute": no TF path leads from frame "mute_eye" of the scans on /mute/scan to the world '
        "(nothing sends the transform of this frame). "
        f"{rest}set broadcast_tf of the laser to true, or send the transform by another node",
        'Model Plugin "eye" type "Laser" model "plain": no TF path leads from frame "plain_eye" of '
        'the scans on /plain/scan to the world (the chain of parents ends at "plain_base"). '
        f"{rest}enable_odom_tf_pub of a drive or publish_tf_world of a ModelTfPublisher sends the "
        'transform from the world to "plain_base"; so does a localisation',
    ]


@pytest.mark.parametrize("kind", ["drive", "world", "fixed"])
def test_a_frame_that_the_world_connects_needs_no_listener(
    start: Any, warnings: Any, kind: str
) -> None:
    setup = start(kind)
    assert not setup.tick(0.0)
    assert not setup.tick(10.0)
    assert setup.transport.subscriptions == []
    assert warnings() == []


def test_transforms_of_other_nodes_connect_frames(start: Any, warnings: Any) -> None:
    setup = start("plain_tf", "plain_static", "plain_cycle", "plain_into_cycle")
    setup.tick(0.0)
    setup.tick(GRACE)
    sent = {
        "plain_tf_base": "odom",
        "plain_cycle_base": "plain_cycle_eye",
        # The frames of other nodes, which may be those of the world elsewhere.
        "plain_into_cycle_base": "theirs",
        "theirs": "theirs as well",
        "theirs as well": "theirs",
    }
    setup.transport.callbacks["/tf"](FrameParents(sent))
    setup.transport.callbacks["/tf_static"](FrameParents({"plain_static_base": "map"}))
    assert setup.tick(0.1)
    assert list(setup.monitor._checks) == [setup.world.ports.outputs["/plain_cycle/scan"]]
    assert not setup.tick(LISTENING)
    (warning,) = warnings()
    assert "of the scans on /plain_cycle/scan to the world" in warning


@pytest.mark.parametrize("reason", ["paused", "no subscriber"])
def test_the_periods_begin_when_scans_are_sent(start: Any, warnings: Any, reason: str) -> None:
    setup = start("plain")
    setup.tick(0.0)
    setup.tick(GRACE)
    assert setup.listening
    if reason == "paused":
        setup.world.pause()
    else:
        setup.idle.add("/plain/scan")
    assert setup.tick(LISTENING)
    assert setup.listening == set()  # until scans are sent again
    setup.world.resume()
    setup.idle.clear()
    assert setup.tick(1.0)
    assert setup.tick(GRACE + LISTENING - 0.1)
    assert setup.tick(LISTENING - 0.1)
    assert warnings() == []
    assert not setup.tick(0.2)
    assert len(warnings()) == 1


def test_a_second_laser_is_listened_to_for_a_period_of_its_own(start: Any, warnings: Any) -> None:
    setup = start("plain", "mute")
    setup.idle.add("/mute/scan")
    setup.tick(0.0)
    setup.tick(GRACE + LISTENING - 0.1)
    setup.idle.clear()
    setup.tick(0.0)
    assert setup.tick(LISTENING)
    assert ["/plain/scan" in warning for warning in warnings()] == [True]
    assert setup.listening
    setup.tick(GRACE - 0.1)
    assert len(warnings()) == 1
    assert not setup.tick(0.2)
    assert len(warnings()) == 2


def test_a_laser_is_checked_from_its_first_scan_until_its_end(start: Any, warnings: Any) -> None:
    setup = start()
    assert not setup.tick(0.0)
    for y, name in enumerate(("plain", "mute")):
        setup.world.spawn_model(f"{name}.model.yaml", name, name, (0.0, y, 0.0))
    wait_until("a tick", lambda: setup.posted)
    setup.world.output("/mute/scan")
    assert setup.tick(10.0)
    assert setup.tick(GRACE + LISTENING)
    assert setup.listening == set()
    setup.world.step()
    assert setup.tick(0.0)
    setup.world.delete_model("mute")
    assert setup.tick(GRACE)
    assert setup.listening == set()
    setup.world.delete_model("plain")
    assert not setup.tick(LISTENING)
    assert warnings() == []
