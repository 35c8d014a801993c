"""The run of a node: what ends it, its exit code, and the order of its parts."""

from __future__ import annotations

import gc
import logging
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from flatland.errors import FlatlandError
from flatland.node import run, served_world
from flatland.node.parameters import ParameterError
from flatland.node.run import NodeRun


class Served:
    """A world that records its use in `calls`."""

    def __init__(self, calls: list[Any], *arguments: Any) -> None:
        calls.append(("load", *arguments))
        self._calls = calls
        self.world = object()
        self.simulation = self

    def stop(self) -> None:
        self._calls.append("stop")

    def run(self) -> None:
        self._calls.append(("run", gc.isenabled()))

    def close(self) -> None:
        self._calls.append("close")


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """What the parts of the run do, in order; no handler of the process is replaced."""
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
    monkeypatch.setattr(served_world, "ServedWorld", lambda *arguments: Served(calls, *arguments))
    monkeypatch.setattr(
        sys, "setswitchinterval", lambda seconds: calls.append(("switch interval", seconds))
    )
    yield calls
    gc.enable()


def is_fault(_kind: type[BaseException]) -> bool:
    return False


def unregister() -> None:
    raise NotImplementedError


@pytest.fixture
def node(calls: list[Any]) -> NodeRun:
    node = NodeRun(is_fault, unregister)
    assert calls == [("reports", is_fault), "reports installed", ("switch interval", 0.0002)]
    calls.clear()
    return node


def test_a_world_is_loaded_run_and_closed(node: NodeRun, calls: list[Any]) -> None:
    @contextmanager
    def more(served: Any) -> Iterator[None]:
        calls.append(("more", served.world is not None))
        yield
        calls.append("no more")

    gc.disable()
    node.serve("parameters", "transport", "clock", more, lambda: calls.append("ended"))  # type: ignore[arg-type]
    assert calls == [
        ("load", "parameters", "transport", "clock"),
        ("more", True),
        ("run", True),
        "ended",
        "no more",
        "close",
    ]
    assert node._fault_reports.world is node._simulation.world  # type: ignore[union-attr]
    assert node.watchdog.unregister is unregister  # type: ignore[attr-defined]
    calls.clear()
    node.watchdog.stop()  # type: ignore[attr-defined]
    assert node.stopping.is_set()
    assert calls == ["stop"]


def test_a_stop_before_the_world_is_loaded_stops_its_simulation(
    node: NodeRun, calls: list[Any]
) -> None:
    node.watchdog.stop()  # type: ignore[attr-defined]
    assert isinstance(node.stopping, threading.Event)
    assert calls == []
    node.serve(None, None, None)  # type: ignore[arg-type]
    assert calls == [("load", None, None, None), "stop", ("run", True), "close"]


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
    caplog.set_level(logging.INFO, "flatland")

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
