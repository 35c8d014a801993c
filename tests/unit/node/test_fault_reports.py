"""Reports of threads that end with an exception, and of crashes."""

from __future__ import annotations

import faulthandler
import logging
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest
from waiting import TIMEOUT

from flatland.node.fault_reports import FaultReports

PLUGIN = """
import flatland


def fail():
    raise RuntimeError("cause")


class Failing(flatland.ModelPlugin):
    def fail(self):
        raise RuntimeError("cause")


class OfWorld(flatland.WorldPlugin):
    pass
"""
MANIFEST = """
<library path="."><class name="test::Failing" type="failing_plugin_of_reports.Failing"
  base_class_type="flatland::ModelPlugin"/>
<class name="test::OfWorld" type="failing_plugin_of_reports.OfWorld"
  base_class_type="flatland::WorldPlugin"/></library>
"""
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base}, {type: "test::Failing", name: bad}]
"""
CRASH = """
import os
import threading

from flatland.node.fault_reports import FaultReports

FaultReports(lambda kind: False).install()
started = threading.Event()


def wait_for_the_end():
    started.set()
    threading.Event().wait()


threading.Thread(target=wait_for_the_end, daemon=True).start()
started.wait()
os.abort()
"""


@pytest.fixture
def reports(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> FaultReports:
    """Reports for which a `ConnectionError` is the fault of a client."""
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(faulthandler, "enable", lambda: None)  # pytest uses it.
    caplog.set_level(logging.WARNING, "flatland")
    reports = FaultReports(lambda kind: issubclass(kind, ConnectionError))
    reports.install()
    return reports


def run_thread(target: Callable[[], object]) -> None:
    thread = threading.Thread(target=target, name="worker")
    thread.start()
    thread.join(TIMEOUT)


OWNER = 'Model Plugin "bad" type "test::Failing" model "robot"'


@pytest.mark.parametrize(
    ("kind", "plugins", "owners"),
    [
        ("method", "[]", OWNER),
        ("function", "[]", OWNER),
        # The file is that of several plugins.
        (
            "function",
            '[{type: "test::OfWorld", name: outer}]',
            f'World Plugin "outer" type "test::OfWorld" or {OWNER}',
        ),
    ],
)
def test_an_exception_is_attributed_to_the_plugins_that_may_have_raised_it(
    reports: FaultReports,
    files: Any,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    plugins: str,
    owners: str,
) -> None:
    files.write("failing_plugin_of_reports.py", PLUGIN)
    files.write("robot.model.yaml", ROBOT)
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", files.write("manifest.xml", MANIFEST))
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "failing_plugin_of_reports", raising=False)
    models = "[{name: robot, model: robot.model.yaml}]"
    reports.world = files.load(
        f"{{properties: {{}}, layers: [{{name: 2d}}], models: {models}, plugins: {plugins}}}"
    )
    plugin = reports.world.model("robot").plugin("bad")
    run_thread(plugin.fail if kind == "method" else sys.modules[type(plugin).__module__].fail)
    [record] = caplog.records
    assert record.getMessage() == f'thread "worker" of {owners} ended with an exception'
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "cause"


def test_an_exception_without_a_thread_and_a_value_is_reported(
    reports: FaultReports, caplog: pytest.LogCaptureFixture
) -> None:
    """As Python calls the hook during its own shutdown."""
    threading.excepthook(threading.ExceptHookArgs((ValueError, None, None, None)))
    [record] = caplog.records
    assert record.getMessage() == 'thread "unknown" ended with an exception'
    assert record.exc_info is not None
    assert isinstance(record.exc_info[1], ValueError)


def test_an_exception_of_other_code_is_attributed_to_its_thread_only(
    reports: FaultReports, files: Any, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> None:
        raise RuntimeError("cause")

    run_thread(fail)  # before a world is loaded
    reports.world = files.load_model(ROBOT.replace("test::Failing", "Bumper"))
    run_thread(fail)
    assert [record.getMessage() for record in caplog.records] == [
        'thread "worker" ended with an exception'
    ] * 2
    assert "RuntimeError: cause" in caplog.text


def test_a_client_that_sends_invalid_data_is_a_warning_and_an_exit_is_not_reported(
    reports: FaultReports, caplog: pytest.LogCaptureFixture
) -> None:
    del reports

    def reject() -> None:
        raise ConnectionError("no header")

    run_thread(reject)
    run_thread(sys.exit)
    [record] = caplog.records
    assert record.levelno == logging.WARNING
    assert record.getMessage() == "closed the connection of a client: no header"
    assert record.exc_info is None


def test_a_crash_prints_the_stacks_of_all_threads() -> None:
    crashed = subprocess.run(
        [sys.executable, "-c", CRASH], capture_output=True, text=True, timeout=TIMEOUT, check=False
    )
    assert crashed.returncode == -signal.SIGABRT
    assert "Fatal Python error: Aborted" in crashed.stderr
    assert "in wait_for_the_end" in crashed.stderr
    assert "in <module>" in crashed.stderr.partition("Current thread")[2]
