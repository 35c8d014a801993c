"""Observers: notifications, and the effect of exceptions."""

from __future__ import annotations

from typing import Any

import pytest

from flatland import FlatlandError, World, WorldObserver
from flatland.simulation import Simulation

ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base}]
"""
EVENTS = (
    *("attached", "detached", "output_opened", "output_closed", "command_opened"),
    *("command_closed", "model_added", "model_moved", "model_removed", "layer_changed"),
    *("step_started", "time_advanced", "transforms_sent", "step_finished"),
)


class Recorder(WorldObserver):
    """Records the names of events; optionally raises in one of them."""

    def __init__(self, bad: str = "") -> None:
        self.bad = bad
        self.events: list[str] = []
        self.attached_to: object = None

    def _record(self, event: str) -> None:
        self.events.append(event)
        if event == self.bad:
            raise RuntimeError(f"{event} is broken")


def _method(event: str) -> Any:
    def record(self: Recorder, *arguments: Any) -> None:
        if event == "attached":
            [self.attached_to] = arguments
        self._record(event)

    return record


for _event in EVENTS:
    setattr(Recorder, _event, _method(_event))


def load(files: Any, *observers: WorldObserver, **options: Any) -> World:
    files.write("robot.model.yaml", ROBOT)
    world: World = files.load(
        "{properties: {}, layers: [{name: 2d}], models: [{name: r, model: robot.model.yaml}]}",
        observers=observers,
        **options,
    )
    return world


def live(world: World) -> None:
    world.step()
    world.move_model("r", (1, 0, 0))
    world.delete_model("r")
    world.close()


def test_an_observer_receives_all_notifications_between_attached_and_detached(files: Any) -> None:
    observer = Recorder()
    world = load(files, observer)
    assert observer.attached_to is world
    live(world)
    assert set(observer.events) == set(EVENTS)
    assert (observer.events[0], observer.events[-1]) == ("attached", "detached")
    assert observer.events.count("detached") == 1


def test_a_removed_observer_receives_no_more_notifications(files: Any) -> None:
    removed, kept = Recorder(), Recorder()
    world = load(files, removed, kept)
    world.remove_observer(removed)
    assert removed.events[-1] == "detached"
    count = len(removed.events)
    live(world)
    assert len(removed.events) == count
    assert "model_removed" in kept.events
    with pytest.raises(ValueError, match="is not an observer of this world"):
        world.remove_observer(removed)


REJECTIONS = ("output_opened", "command_opened")
CONTAINED = [event for event in EVENTS if event not in ("attached", *REJECTIONS)]


@pytest.mark.parametrize("event", CONTAINED)
def test_an_exception_of_an_observer_is_logged_and_has_no_effect(
    files: Any, caplog: pytest.LogCaptureFixture, event: str
) -> None:
    bad, good = Recorder(event), Recorder()
    world = load(files, bad, good, plugin_errors="disable")
    assert [model.name for model in world.models] == ["r"]
    live(world)
    assert world.closed
    assert good.events == bad.events
    assert f"observer Recorder: {event} raised" in caplog.text
    assert f"RuntimeError: {event} is broken" in caplog.text


@pytest.mark.parametrize("event", CONTAINED)
def test_an_exception_of_an_observer_is_raised_by_the_next_step_or_close(
    files: Any, event: str
) -> None:
    bad, good = Recorder(event), Recorder()
    world = load(files, bad, good, plugin_errors="raise")
    raised = []
    for act in (world.step, world.step, lambda: world.move_model("r", (1, 0, 0)), world.step,
                lambda: world.delete_model("r"), world.step, world.close):  # fmt: skip
        try:
            act()
        except RuntimeError as error:
            raised.append((act, str(error), error.__notes__))
    assert world.closed
    assert good.events == bad.events
    assert raised
    for act, text, notes in raised:
        assert act in (world.step, world.close)
        assert text == f"{event} is broken"
        assert notes == [f"raised by observer Recorder: {event}"]


@pytest.mark.parametrize("event", REJECTIONS)
def test_a_rejected_port_fails_the_model_and_other_observers_are_notified(
    files: Any, event: str
) -> None:
    good, bad = Recorder(), Recorder(event)
    with pytest.raises(FlatlandError, match=f"{event} is broken"):
        load(files, good, bad)
    closed = event.replace("opened", "closed")
    assert good.events.count(event) == good.events.count(closed) > 0


@pytest.mark.parametrize("name", ["watches_steps", "watches_time", "wants_transforms"])
def test_an_exception_of_a_property_does_not_interrupt_a_step(
    files: Any, caplog: pytest.LogCaptureFixture, name: str
) -> None:
    def fail(_: object) -> bool:
        raise RuntimeError("no answer")

    unattended = {"watches_steps": False}
    watcher = type("Watcher", (Recorder,), {**unattended, name: property(fail)})()
    other = type("Other", (Recorder,), unattended)()
    world = load(files, watcher, other, plugin_errors="disable")
    Simulation(world, update_rate=0).run(0.025)
    assert world.time == pytest.approx(0.025)
    assert "transforms_sent" in other.events
    if name != "watches_time":  # which is read in real time only
        assert f"observer Watcher: {name} raised" in caplog.text
    Simulation(world, update_rate=1000).run(0.025)
    assert f"observer Watcher: {name} raised" in caplog.text
    assert world.time == pytest.approx(0.05)
