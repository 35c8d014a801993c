"""Earlier states of a world: which are kept, and how clients return to them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from raw_web_client import RawWebClient
from waiting import wait_until

from flatland import Twist
from flatland.web import WebViewer, feed, history
from flatland.web.history import History
from flatland.world import World


class Clock:
    """A wall time that advances on request."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """The clock of the history; snapshots are as cheap as they are said to be."""
    monkeypatch.setattr(history, "SHARE", 1.0)
    return Clock()


@pytest.fixture
def kept(world: World, clock: Clock) -> History:
    """The history of the world."""
    return History(world, clock)


@pytest.fixture
def run(kept: History, world: World, clock: Clock) -> Callable[[float], None]:
    """Runs the world for some seconds."""

    def run(seconds: float) -> None:
        for _ in range(round(2 * seconds)):
            clock.now += 0.5
            world.step(100)
            kept.update()

    return run


def times(kept: History) -> list[float]:
    return [time for _, time, _ in kept.timeline.moments]


class TestMoments:
    def test_older_moments_are_kept_at_a_longer_period(self, kept, run, world, monkeypatch):
        monkeypatch.setattr(history, "RECENT", 6.0)
        monkeypatch.setattr(history, "MAX_AGE", 60.0)
        run(80)
        gaps = np.diff(times(kept))
        recent = round(history.RECENT / history.PERIOD)
        assert set(gaps[-recent + 1 :]) == {history.PERIOD}
        assert set(gaps[1 : -recent - 5]) == {history.COARSE_PERIOD}
        assert world.time - times(kept)[0] == pytest.approx(history.MAX_AGE, abs=6)

    def test_an_expensive_snapshot_delays_the_next_one(self, kept, run, monkeypatch):
        monkeypatch.setattr(history, "SHARE", 1e-7)
        run(20)
        assert len(times(kept)) == 1

    def test_the_memory_is_limited(self, kept, run, world, monkeypatch):
        monkeypatch.setattr(history, "MAX_BYTES", 8.5 * world.snapshot().size)
        run(19.5)
        assert times(kept)[-1] == world.time
        assert len(times(kept)) == 8

    def test_a_world_without_changes_needs_no_moments(self, kept, run, world, clock):
        run(2.5)
        count = len(times(kept))
        clock.now += 10
        kept.update()
        assert len(times(kept)) == count
        world.move_model("robot", (2, 2, 0))
        kept.update()
        assert len(times(kept)) == count + 1

    def test_obstacles_are_named(self, kept, run, world, monkeypatch):
        world.models[0].plugins[0].task = (i for i in range(3))
        run(1)
        assert 'attribute "task"' in kept.timeline.obstacle
        del world.models[0].plugins[0].task
        run(11)
        assert kept.timeline.obstacle == ""
        monkeypatch.setattr(history, "MAX_BYTES", 1000)
        run(2)
        assert "map is too large" in kept.timeline.obstacle

    def test_a_recorded_world_has_no_regular_moments(self, kept, run, world, tmp_path):
        world.record(tmp_path / "run.flog")
        run(3)
        assert times(kept) == []
        assert "recorded" in kept.timeline.obstacle

    def test_a_world_that_goes_on_drops_the_later_moments(self, kept, run, world, clock):
        run(5)
        before = kept.timeline.moments
        kept.visit(before[1][0], world.restore)
        world.pause()
        kept.update()
        assert kept.timeline.current == before[1][0]
        assert [label for _, _, label in kept.timeline.moments[-2:]] == ["", history.NEWEST]
        world.step(while_paused=True)
        clock.now += 5
        kept.update()
        assert kept.timeline.current is None
        assert kept.timeline.moments[:2] == before[:2]
        assert times(kept) == [before[0][1], before[1][1], world.time]

    def test_a_failed_visit_leaves_the_history_as_it_was(self, kept, run):
        run(3)
        before = kept.timeline

        def fail(_: Any) -> None:
            raise RuntimeError

        with pytest.raises(RuntimeError):
            kept.visit(before.moments[0][0], fail)
        assert kept.timeline is before


@pytest.fixture
def client(client: RawWebClient) -> RawWebClient:
    """A client that looks at the history of a world whose robot drives."""
    client.ask("look", history=True)
    return client


def pose(world: World) -> tuple[float, ...]:
    return world.between_steps(lambda: world.model("robot").pose)


def wait_moments(client: RawWebClient, count: int = 1) -> dict[str, Any]:
    return client.wait("history", lambda message: len(message["moments"]) >= count)


class TestRequests:
    def test_a_visited_state_is_shown_and_the_newest_one_returns(self, client, world):
        first = wait_moments(client)["moments"][0]
        client.ask("move", model=client.model("robot")["id"], pose=[6, 6, 0])
        assert client.ask("visit", moment=first["moment"]) == {"effect": ""}
        assert world.paused
        assert world.time == first["time"]
        np.testing.assert_allclose(pose(world), (3, 5, 0), atol=1e-6)
        shown = client.wait("history", lambda m: m["current"] == first["moment"])
        newest = shown["moments"][-1]
        assert newest["label"] == history.NEWEST
        client.ask("visit", moment=newest["moment"])
        assert world.paused
        assert world.time == newest["time"]
        np.testing.assert_allclose(pose(world), (6, 6, 0), atol=1e-6)
        client.wait("history", lambda m: m["current"] is None)

    def test_the_world_continues_from_a_visited_state(self, client, world):
        first = wait_moments(client)["moments"][0]
        number = client.send("drive", model=client.model("robot")["id"], linear=[1, 0])
        client.wait("reply", lambda message: message["id"] == number)
        wait_until("the robot has moved", lambda: pose(world)[0] > 3.05)
        client.ask("visit", moment=first["moment"])
        client.ask("resume")
        client.wait("history", lambda m: m["current"] is None)
        wait_until("the world runs", lambda: world.time > first["time"] + 0.1)

    def test_another_client_sees_and_ends_a_visit(self, client, world, url):
        first = wait_moments(client)["moments"][0]
        with RawWebClient(url) as other:
            other.ask("look", history=True)
            client.ask("visit", moment=first["moment"])
            other.wait("history", lambda m: m["current"] == first["moment"])
            other.ask("step")
        client.wait("history", lambda m: m["current"] is None)

    def test_a_visit_during_a_drag_keeps_the_world_paused(self, client, world, url):
        first = wait_moments(client)["moments"][0]
        with RawWebClient(url) as other:
            robot = other.wait_model("robot")["id"]
            other.ask("hold", model=robot)
            other.ask("move", model=robot, pose=[6, 6, 0])
            client.ask("visit", moment=first["moment"])
            np.testing.assert_allclose(pose(world), (3, 5, 0), atol=1e-6)
            # The drag goes on in the visited state.
            other.ask("hold", model=robot)
            other.ask("move", model=robot, pose=[5, 5, 0])
            other.ask("release", model=robot)
        np.testing.assert_allclose(pose(world), (5, 5, 0), atol=1e-6)
        assert world.paused
        assert world.time == first["time"]

    def test_states_are_dropped_when_no_client_has_looked_for_long(self, url, viewer, monkeypatch):
        monkeypatch.setattr(feed, "MAX_AGE", 0.01)
        with RawWebClient(url) as client:
            client.ask("look", history=True)
            wait_moments(client)
        kept = viewer._hub.feeds[0].history
        wait_until("the states are dropped", lambda: kept.timeline.moments == ())

    def test_a_dropped_state_is_an_error_and_does_not_pause(self, client, world):
        assert client.reply("visit", moment=10**6)["error"] == "this state is not kept any more"
        assert not world.paused

    def test_a_reset_is_undone_and_repeated(self, client, world):
        client.ask("spawn", file="box.model.yaml", name="box", pose=[6, 6, 0])
        client.ask("pause")
        time, command = world.time, world.command("/cmd_vel")
        command.set(Twist(linear_x=0.5))
        assert client.ask("reset") == {"can_undo": True, "effect": ""}
        assert (world.time, [model.name for model in world.models]) == (0, ["robot"])
        assert world.paused
        assert client.ask("undo")["text"] == "the reset of the world"
        assert (world.time, [model.name for model in world.models]) == (time, ["robot", "box"])
        assert command.value == Twist(linear_x=0.5)
        client.ask("step")
        client.ask("redo")
        assert (world.time, [model.name for model in world.models]) == (0, ["robot"])
        client.ask("undo")
        assert world.time == pytest.approx(time + 0.005)

    def test_a_world_that_cannot_be_saved_is_reset_without_undo(self, client, world):
        plugin: Any = world.models[0].plugins[0]
        world.between_steps(lambda: setattr(plugin, "task", (i for i in range(3))))
        assert client.ask("reset")["can_undo"] is False
        assert "nothing to undo" in client.reply("undo")["error"]

    def test_a_world_without_a_file_is_not_reset(self, viewer):
        with World() as world:
            viewer.add_world(world)
            with RawWebClient(viewer.url) as client:
                assert "loaded from a file" in client.reply("reset")["error"]

    def test_read_only_clients_cause_no_snapshots(self, world, simulation):
        with WebViewer(port=0, read_only=True) as viewer:
            viewer.add_world(world, simulation=simulation)
            with RawWebClient(viewer.url) as client:
                client.ask("look", history=True)
                client.wait("status")
                client.wait("status")
                assert "history" not in {m["type"] for m in client.received if isinstance(m, dict)}
                assert world.between_steps(world.snapshot).number == 0
