"""The run of a node: what ends it, and its exit code."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from full_disk import REASON, limited_files
from waiting import TIMEOUT, wait_until

from flatland.errors import FlatlandError
from flatland.node import run
from flatland.node.clock import SimulatedClock
from flatland.node.parameters import ParameterError, read_parameters
from flatland.node.run import NodeRun
from flatland.node.served_world import ServedWorld
from flatland.world import World


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """What a run changes of the process, which nothing of it does in a test."""
    calls: list[Any] = []

    class Watchdog:
        def __init__(self, stop: Callable[[], None], unregister: Callable[[], None]) -> None:
            self.stop, self.unregister = stop, unregister

    class Reports:
        world: Any = None

        def __init__(self, is_fault_of_client: Any) -> None:
            calls.append(("reports", is_fault_of_client))

        def install(self) -> None:
            calls.append("reports installed")

    monkeypatch.setattr(run, "ShutdownWatchdog", Watchdog)
    monkeypatch.setattr(run, "FaultReports", Reports)
    monkeypatch.setattr(
        sys, "setswitchinterval", lambda seconds: calls.append(("switch interval", seconds))
    )
    yield calls
    gc.unfreeze()
    gc.enable()


def is_fault(_kind: type[BaseException]) -> bool:
    return False


def unregister() -> None:
    raise NotImplementedError


@pytest.fixture
def node(calls: list[Any]) -> NodeRun:
    node = NodeRun(is_fault, unregister)
    assert calls == [("reports", is_fault), "reports installed", ("switch interval", 0.0002)]
    assert node.watchdog.unregister is unregister  # type: ignore[attr-defined]
    return node


@pytest.mark.parametrize("stopped_before", [False, True])
def test_a_world_is_loaded_run_until_a_stop_and_closed(
    node: NodeRun, files: Any, transport: Any, stopped_before: bool
) -> None:
    events: list[Any] = []
    stop = node.watchdog.stop  # type: ignore[attr-defined]

    def stop_after_a_step(world: World) -> None:
        wait_until("a step", lambda: world.time > 0.0)
        stop()

    @contextmanager
    def more(served: ServedWorld) -> Iterator[None]:
        events.append(served.world)
        if not stopped_before:
            served.simulation.post(lambda: events.append(gc.isenabled()))
            threading.Thread(target=stop_after_a_step, args=(served.world,)).start()
        yield
        assert not served.world.closed
        assert (served.world.time == 0.0) is stopped_before
        events.append("no more")

    path = files.write("world.yaml", "{properties: {}, layers: []}")
    parameters = read_parameters({"world_path": path}.get)
    gc.disable()
    if stopped_before:
        stop()
    clock = SimulatedClock(transport)
    node.serve(parameters, transport, clock, more, lambda: events.append("ended"))
    world = events.pop(0)
    assert events == [*([] if stopped_before else [True]), "ended", "no more"]
    assert world.closed
    assert node.stopping.is_set()
    assert node._fault_reports.world is world
    # It may log that the world is closed.
    for thread in threading.enumerate():
        if thread.name == "flatland-deferred-topics":
            thread.join(TIMEOUT)


@pytest.mark.parametrize(
    ("error", "text", "has_traceback"),
    [
        (ParameterError("invalid"), "invalid", False),
        (FlatlandError("broken file"), "broken file", False),
        (RuntimeError("cause"), "unexpected internal error", True),
    ],
)
@pytest.mark.parametrize("stopping", [False, True])
def test_a_failure_is_the_exit_code_unless_a_stop_was_requested(
    node: NodeRun,
    caplog: pytest.LogCaptureFixture,
    error: Exception,
    text: str,
    has_traceback: bool,
    stopping: bool,
) -> None:
    caplog.set_level("INFO", "flatland")

    def simulate() -> None:
        raise error

    if stopping:
        node.watchdog.stop()  # type: ignore[attr-defined]
    assert node.exit_code_of(simulate) == (0 if stopping else 1)
    [record] = caplog.records
    if stopping:
        assert (record.levelname, record.getMessage()) == ("INFO", f"stopped: {text}")
    else:
        assert (record.levelname, record.getMessage()) == ("CRITICAL", text)
        assert bool(record.exc_info) is has_traceback


def test_the_exit_code_of_a_run_without_a_failure_is_0(node: NodeRun) -> None:
    assert node.exit_code_of(lambda: None) == 0


def test_a_recording_that_is_cut_is_named_at_the_end(
    node: NodeRun, files: Any, transport: Any, caplog: pytest.LogCaptureFixture
) -> None:
    path = files.write("world.yaml", "{properties: {}, layers: []}")
    recording = files.folder / "run.flog"
    values = {"world_path": path, "record": str(recording), "update_rate": 0}
    parameters = read_parameters(values.get)

    @contextmanager
    def more(served: ServedWorld) -> Iterator[None]:
        served.simulation.post(node.watchdog.stop)  # type: ignore[attr-defined]
        with limited_files(recording.stat().st_size):
            yield
            served.world.close()

    clock = SimulatedClock(transport)
    assert node.exit_code_of(lambda: node.serve(parameters, transport, clock, more)) == 1
    assert f'"{recording}" is incomplete: {REASON}, at step ' in caplog.text
