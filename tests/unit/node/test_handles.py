"""Drags of handles, which pause the world, without ROS."""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from waiting import wait_until

from flatland.node.handles import DELETE_ENTRY, DRAG_TIMEOUT, Event, Feedback, Handles
from flatland.node.ticker import TickerThread
from flatland.node.values import ReceivedPose
from flatland.simulation import Simulation

WORLD = """
properties: {}
layers: [{name: 2d}]
models: [{name: a, model: ball.model.yaml}, {name: b, model: ball.model.yaml, pose: [5, 0, 0]}]
"""
BALL = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"


class FakeServer:
    """Records the changes of handles."""

    connected = True

    def __init__(self) -> None:
        self.handles: set[str] = set()
        self.moved: list[str] = []
        self.inserted: list[str] = []
        self.keep_alives = 0
        self.applied = 0
        self.erased: list[str] = []

    def insert(self, _model: object, name: str) -> None:
        self.handles.add(name)
        self.inserted.append(name)

    def erase(self, name: str) -> None:
        self.handles.remove(name)
        self.erased.append(name)

    def move(self, name: str) -> None:
        self.moved.append(name)

    def apply_changes(self) -> None:
        self.applied += 1

    def keep_alive(self) -> None:
        self.keep_alives += 1


class Setup:
    """The handles of two models, and feedback of clients."""

    def __init__(self, world: Any) -> None:
        self.world = world
        self.server = FakeServer()
        self.simulation = Simulation(world)
        self.posted: list[object] = []  # ticks that wait; the test ticks itself
        thread = TickerThread("handles", self._post)
        self.handles = Handles(self.simulation, thread, lambda *_: self.server)

    def _post(self, action: object) -> Future[Any]:
        self.posted.append(action)
        return Future()

    def send(
        self,
        name: str,
        event: Event,
        x: float = 1.0,
        *,
        client: str = "rviz",
        time: float = 0.0,
        frame: str = "map",
        entry: int = 0,
    ) -> None:
        pose = ReceivedPose(frame, (x, 2.0, 0.0))
        self.handles.receive(Feedback(name, client, event, entry, pose, time))


@pytest.fixture
def setup(files: Any) -> Iterator[Setup]:
    files.write("ball.model.yaml", BALL)
    setup = Setup(files.load(WORLD))
    yield setup
    setup.handles.close()


def test_the_world_is_paused_until_the_last_drag_ends(setup: Setup) -> None:
    setup.send("a", Event.PRESS)
    setup.send("b", Event.MOVE, client="other")
    assert setup.world.paused
    setup.send("a", Event.RELEASE, 3.0)
    assert setup.world.paused
    assert setup.world.model("a").pose == (3.0, 2.0, 0.0)
    setup.send("b", Event.RELEASE, client="other")
    assert not setup.world.paused


def test_a_model_can_be_dragged_onto_another_one(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    setup.world.move_model("b", (3.0, 2.0, 0.0))
    setup.send("a", Event.PRESS)
    setup.send("a", Event.RELEASE, 3.0)
    assert setup.world.model("a").pose == (3.0, 2.0, 0.0)
    assert "overlaps" not in caplog.text


def test_a_pause_by_other_means_during_a_drag_remains(setup: Setup) -> None:
    setup.send("a", Event.PRESS)
    setup.world.resume()
    setup.handles._tick(0.05)
    setup.world.pause()
    setup.send("a", Event.RELEASE)
    assert setup.world.paused


def test_a_drag_without_feedback_ends_and_the_model_does_not_move(setup: Setup) -> None:
    setup.send("a", Event.PRESS, time=1.0)
    setup.send("a", Event.KEEP_ALIVE, time=2.0)
    assert setup.handles._tick(2.09)
    assert setup.world.paused
    assert setup.handles.pose_of("a") == (1.0, 2.0, 0.0)
    setup.handles._tick(2.11)
    assert not setup.world.paused
    assert setup.handles.pose_of("a") == (0.0, 0.0, 0.0)
    assert setup.server.moved[-1] == "a"


def test_a_drag_by_another_client_is_ignored(setup: Setup) -> None:
    setup.send("a", Event.PRESS)
    setup.send("a", Event.RELEASE, 4.0, client="other")
    assert setup.world.paused
    assert setup.world.model("a").pose == (0.0, 0.0, 0.0)


def test_a_pose_in_another_frame_is_ignored(setup: Setup, caplog: pytest.LogCaptureFixture) -> None:
    setup.send("a", Event.PRESS, frame="odom")
    assert not setup.world.paused
    assert 'ignoring a pose in frame "odom", expected frame "map"' in caplog.text


def test_an_invalid_pose_is_a_warning_that_names_the_handle(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    setup.send("a", Event.RELEASE, math.nan)
    assert 'interactive marker "a": Flatland World: failed to move model "a"' in caplog.text
    assert setup.world.model("a").pose == (0.0, 0.0, 0.0)


def test_the_menu_deletes_a_model_whose_drag_ends(setup: Setup) -> None:
    setup.send("a", Event.PRESS)
    setup.send("a", Event.MENU, entry=DELETE_ENTRY)
    assert setup.server.handles == {"b"}
    assert not setup.world.paused
    setup.send("a", Event.PRESS)  # There is no such handle.
    assert not setup.world.paused


def test_poses_are_published_once_and_only_with_clients(setup: Setup) -> None:
    setup.world.move_model("a", (3.0, 0.0, 0.0))
    setup.server.connected = False
    assert setup.handles._tick(1.0) is False
    assert setup.server.moved == []
    setup.server.connected = True
    assert setup.handles._tick(2.0)
    assert setup.server.moved == ["a"]
    assert setup.handles._tick(3.0)
    assert setup.server.moved == ["a"]


def test_clients_are_informed_twice_a_second_that_the_server_is_there(setup: Setup) -> None:
    counts = []
    for time in (1.0, 1.4, 1.5, 1.9):
        setup.handles._tick(time)
        counts.append(setup.server.keep_alives)
    assert counts == [1, 1, 2, 2]
    assert not setup.posted
    setup.handles.connection_changed()  # A new client is informed at once.
    wait_until("a tick", lambda: setup.posted)
    setup.handles._tick(1.95)
    assert setup.server.keep_alives == 3


def test_the_handle_of_a_model_with_other_colors_is_replaced(setup: Setup) -> None:
    assert setup.server.inserted == ["a", "b"]
    setup.world.set_appearance("b", color=(1.0, 0.0, 0.0, 1.0))
    assert setup.server.inserted == ["a", "b", "b"]
    assert setup.server.erased == ["b"]
    assert setup.server.handles == {"a", "b"}
    setup.handles._tick(1.0)
    assert setup.server.moved == ["b"]  # Clients show the pose of the new handle.


def test_feedback_that_is_no_drag_changes_nothing(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    setup.send("a", Event.KEEP_ALIVE, time=5.0)
    setup.send("a", Event.MENU, entry=DELETE_ENTRY + 1)
    assert not setup.world.paused
    assert setup.server.handles == {"a", "b"}
    assert setup.server.moved == []
    assert not setup.posted
    assert caplog.records == []


def test_a_handle_returns_to_its_model_after_a_drag_without_effect(setup: Setup) -> None:
    """Clients show the last pose of the drag, which the server has not published."""
    setup.send("a", Event.PRESS, time=0.0)
    setup.handles._tick(DRAG_TIMEOUT)
    assert setup.world.paused
    assert setup.server.moved == ["a"]
    setup.send("a", Event.RELEASE, frame="odom")
    setup.handles._tick(1.0)
    assert setup.server.moved == ["a", "a"]
    setup.send("b", Event.PRESS, time=1.0)
    setup.handles._tick(5.0)
    assert setup.server.moved == ["a", "a", "b"]
    setup.send("b", Event.RELEASE, frame="odom")
    setup.handles._tick(6.0)
    assert setup.server.moved == ["a", "a", "b", "b"]


def test_the_name_of_a_deleted_model_is_used_again(setup: Setup) -> None:
    setup.server.connected = False
    path = setup.world.model("a").path
    setup.world.delete_model("a")
    applied = setup.server.applied
    setup.world.spawn_model(path, "a", pose=(0.0, 5.0, 0.0))
    assert setup.server.inserted == ["a", "b", "a"]
    assert setup.server.applied == applied + 1


def test_an_internal_error_is_logged(
    setup: Setup, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("cause")

    monkeypatch.setattr(setup.world, "delete_model", fail)
    setup.send("a", Event.MENU, entry=DELETE_ENTRY)
    [record] = caplog.records
    assert record.levelname == "ERROR"
    assert "unexpected internal error in the feedback" in record.getMessage()
    assert record.exc_info is not None


def test_poses_are_published_30_times_per_second_until_the_end(setup: Setup) -> None:
    ticker = setup.handles._ticker
    assert ticker.period == 1.0 / 30.0
    setup.handles.close()
    assert ticker.closed


def test_a_drag_ticks_until_it_ends_also_without_clients(setup: Setup) -> None:
    setup.server.connected = False
    setup.send("a", Event.PRESS, time=1.0)
    wait_until("a tick", lambda: setup.posted)
    assert setup.handles._tick(1.05) is True
    setup.send("a", Event.RELEASE, time=1.2)
    assert setup.handles._tick(1.3) is False


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (1.0, 2.0, 3.0)])
@pytest.mark.parametrize(
    ("by", "moved"),
    [
        ((0.0, 0.0, 0.00015), True),
        ((0.0, 0.0, -0.1), True),
        ((0.00015, 0.0, 0.0), True),
        ((0.0, -0.00015, 0.0), True),
        ((0.0, 0.0, 2.0 * math.pi), False),
        ((9e-5, -9e-5, 9e-5), False),
    ],
)
def test_a_changed_pose_is_published(
    setup: Setup,
    start: tuple[float, float, float],
    by: tuple[float, float, float],
    moved: bool,
) -> None:
    setup.world.move_model("a", start)
    setup.handles._tick(1.0)
    setup.server.moved.clear()
    applied = setup.server.applied
    x, y, theta = (a + b for a, b in zip(start, by, strict=True))
    setup.world.move_model("a", (x, y, theta))
    setup.handles._tick(2.0)
    assert setup.server.moved == (["a"] if moved else [])
    assert setup.server.applied == applied + 1


def test_changes_are_applied_at_once_without_clients(setup: Setup) -> None:
    setup.world.delete_model("b")
    assert setup.server.applied == 0  # by the next tick
    setup.server.connected = False
    setup.world.set_appearance("a", color=(1.0, 0.0, 0.0, 1.0))
    assert setup.server.applied == 1
    setup.world.delete_model("a")
    assert setup.server.applied == 2
    assert setup.server.handles == set()


def test_nothing_happens_after_the_end(setup: Setup) -> None:
    setup.handles.close()
    setup.send("a", Event.PRESS)
    assert not setup.world.paused
    setup.world.set_appearance("b", color=(1.0, 0.0, 0.0, 1.0))
    setup.world.spawn_model(setup.world.model("a").path, "c", pose=(0.0, 5.0, 0.0))
    setup.world.delete_model("b")
    assert setup.server.inserted == ["a", "b"]
    assert setup.server.handles == {"a", "b"}


@pytest.mark.parametrize("keep", [False, True])
def test_a_drag_keeps_the_odometry_on_request(files: Any, keep: bool) -> None:
    drive = "plugins: [{type: DiffDrive, name: drive, body: base}]"
    world = files.load_model(f"{BALL}\n{drive}")
    odometry = world.output("/odometry/filtered")
    simulation = Simulation(world)
    thread = TickerThread("handles", simulation.post)
    options = {"move_keeps_odometry": True} if keep else {}
    handles = Handles(simulation, thread, lambda *_: FakeServer(), **options)
    pose = ReceivedPose("", (1.0, 2.0, 0.0))
    handles.receive(Feedback("robot", "rviz", Event.RELEASE, 0, pose, 0.0))
    handles.close()
    world.step()
    assert world.model("robot").pose == (1.0, 2.0, 0.0)
    assert odometry.latest.pose == pytest.approx((0, 0, 0) if keep else (1, 2, 0), abs=1e-6)
