"""The checks of the frames of lasers, tick by tick, with a world of the test."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from flatland.node import frame_monitor
from flatland.node.frame_monitor import FrameMonitor
from flatland.node.values import FrameParents
from flatland.values import LaserScan, Odometry

GRACE, LISTENING = 1.0, 2.0  # s


class Laser:
    """An output."""

    def __init__(self, frame: str | None, topic: str = "/scan", kind: type = LaserScan) -> None:
        self.value_type = kind
        self.topic = topic
        self.owners = ["laser of a", "laser of b"]
        self.latest = None if frame is None else SimpleNamespace(frame_id=frame)
        self.subscribed = True


class Setup:
    """A monitor whose ticks are those of the test."""

    def __init__(self, transport: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        self.transport = transport
        self.woken = 0
        body = SimpleNamespace(name="base")
        self.world = SimpleNamespace(
            ports=SimpleNamespace(outputs={}),
            paused=False,
            transforms={},
            models=[SimpleNamespace(bodies=[body], frame=lambda name: f"r_{name}")],
            observers=[],
        )
        self.world.add_observer = self.world.observers.append
        monkeypatch.setattr(frame_monitor, "time", SimpleNamespace(monotonic=lambda: self.now))
        monkeypatch.setattr(frame_monitor, "Ticker", self._ticker)
        self.closed: list[str] = []
        subscribe = transport.subscribe

        def record(topic: str, *arguments: Any) -> Any:
            subscriber = subscribe(topic, *arguments)
            monkeypatch.setattr(subscriber, "close", lambda: self.closed.append(topic))
            return subscriber

        monkeypatch.setattr(transport, "subscribe", record)

    def _ticker(self, *arguments: Any) -> Any:
        self.ticker = arguments
        return self

    # -- the ticker

    def wake(self) -> None:
        self.woken += 1

    def close(self) -> None:
        self.closed.append("ticker")

    # -- the monitor

    def start(self, *lasers: Laser) -> FrameMonitor:
        self.world.ports.outputs = {laser.topic: laser for laser in lasers}
        simulation: Any = SimpleNamespace(world=self.world, post="post")
        self.monitor = FrameMonitor(
            self.transport,
            simulation,
            lambda output: output.subscribed,  # type: ignore[attr-defined]
            grace_period=GRACE,
            listening_period=LISTENING,
        )
        return self.monitor

    def tick(self, seconds: float) -> bool:
        """Ticks some time after the previous tick [s]."""
        self.now += seconds
        return self.monitor._tick(self.now)

    @property
    def is_listening(self) -> bool:
        return self.monitor._listener is not None


@pytest.fixture
def setup(transport: Any, monkeypatch: pytest.MonkeyPatch) -> Setup:
    return Setup(transport, monkeypatch)


REST = (
    "Subscribers such as RViz or a costmap cannot transform the scans. Remedy: "
    "set broadcast_tf of the laser to true, or send the transform by another node"
)


def test_a_frame_without_transforms_is_a_warning_after_both_periods(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    monitor = setup.start(Laser("eye"), Laser("eye", "/odom", Odometry))
    assert setup.ticker == ("flatland-frames", frame_monitor.RATE, "post", monitor._tick)
    assert setup.woken == 1
    assert setup.world.observers == [monitor]
    assert setup.tick(0.0)
    assert setup.tick(GRACE - 0.1)
    assert not setup.is_listening
    assert setup.tick(0.1)
    assert setup.is_listening
    assert set(setup.transport.callbacks) == {"/tf", "/tf_static"}
    assert setup.tick(LISTENING - 0.1)
    assert caplog.records == []
    assert not setup.tick(0.1)
    text = (
        'laser of a and laser of b: no TF path leads from frame "eye" of the scans on /scan to the '
        f"world (nothing sends the transform of this frame). {REST}"
    )
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        ("WARNING", text)
    ]
    assert setup.closed == ["/tf", "/tf_static"]
    assert not setup.is_listening
    monitor.close()
    assert setup.closed[-1] == "ticker"


def test_the_end_of_a_chain_is_named(setup: Setup, caplog: pytest.LogCaptureFixture) -> None:
    setup.world.transforms = {("r_base", "eye"): None}
    setup.start(Laser("eye"))
    for _ in range(4):
        setup.tick(1.0)
    [record] = caplog.records
    assert 'to the world (the chain of parents ends at "r_base")' in record.getMessage()
    assert 'sends the transform from the world to "r_base"; so does a localisation' in (
        record.getMessage()
    )


@pytest.mark.parametrize(
    "transforms",
    [
        {("map", "eye"): None},
        {("r_base", "eye"): None, ("odom", "r_base"): None},  # of another node from there on
        {("base", "eye"): None, ("map", "base"): None},
    ],
)
def test_a_frame_that_the_world_connects_needs_no_listener(
    setup: Setup, transforms: dict[Any, None], caplog: pytest.LogCaptureFixture
) -> None:
    setup.world.transforms = transforms
    setup.start(Laser("eye"))
    assert not setup.tick(0.0)
    assert setup.transport.callbacks == {}
    assert not setup.tick(10.0)
    assert caplog.records == []


def test_a_frame_that_another_node_connects_is_no_warning(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    setup.world.transforms = {("r_base", "eye"): None}
    setup.start(Laser("eye"))
    setup.tick(0.0)
    setup.tick(GRACE)
    setup.transport.callbacks["/tf_static"](FrameParents({"r_base": "odom"}))
    setup.transport.callbacks["/tf"](FrameParents({"odom": "map"}))
    assert not setup.tick(0.1)
    assert caplog.records == []
    assert setup.closed == ["/tf", "/tf_static"]


@pytest.mark.parametrize("reason", ["no scan", "paused", "no subscriber"])
def test_the_periods_begin_when_scans_are_sent(
    setup: Setup, caplog: pytest.LogCaptureFixture, reason: str
) -> None:
    laser = Laser("eye")
    setup.start(laser)
    setup.tick(0.0)
    setup.tick(GRACE)
    assert setup.is_listening
    scan = laser.latest
    if reason == "no scan":
        laser.latest = None
    setup.world.paused = reason == "paused"
    laser.subscribed = reason != "no subscriber"
    assert setup.tick(LISTENING)
    assert setup.closed == ["/tf", "/tf_static"]  # until scans are sent again
    laser.latest, setup.world.paused, laser.subscribed = scan, False, True
    assert setup.tick(1.0)
    assert setup.tick(GRACE + LISTENING - 0.1)
    assert setup.tick(LISTENING - 0.1)
    assert caplog.records == []
    assert not setup.tick(0.2)
    assert len(caplog.records) == 1


def test_a_second_laser_is_listened_to_for_a_period_of_its_own(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    second = Laser("ear", "/second")
    second.subscribed = False
    monitor = setup.start(Laser("eye"), second)
    setup.tick(0.0)
    setup.tick(GRACE + LISTENING - 0.1)
    second.subscribed = True
    setup.tick(0.0)
    setup.tick(LISTENING)
    assert [record.getMessage().count("/scan") for record in caplog.records] == [1]
    assert setup.is_listening
    setup.tick(GRACE - 0.1)
    assert len(caplog.records) == 1
    setup.tick(0.2)
    assert len(caplog.records) == 2
    assert monitor._checks == {}


def test_a_laser_that_is_deleted_is_not_checked(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    laser: Any = Laser("eye")
    monitor = setup.start(laser)
    setup.tick(0.0)
    monitor.output_closed(laser)
    monitor.output_closed(laser)
    assert not setup.tick(10.0)
    monitor.output_opened(laser)
    assert setup.woken == 2
    assert setup.tick(1.0)
    assert caplog.records == []
