"""Fixtures for all tests."""

from __future__ import annotations

import contextlib
import faulthandler
import functools
import gc
import itertools
import os
import re
import signal
import sys
import time
import uuid
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

# Each process of pytest-xdist imports Hypothesis and all modules of the tests, and would spend most
# of this time with their compilation. The processes share what each of them has compiled.
sys.dont_write_bytecode = False

from hypothesis import HealthCheck, settings  # noqa: E402
from hypothesis.internal.conjecture import providers  # noqa: E402

# A shell starts programs in the background with SIGINT ignored, which the programs that the tests
# start, and end with SIGINT, would inherit.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The tests create many small files, for which a file system in memory takes a tenth of the time of
# one on a disk. The shared memory of containers is often small, or programs in it cannot run.
_MEMORY = Path("/dev/shm")
_MEMORY_NEEDED = 2 << 30  # bytes
if os.access(_MEMORY, os.W_OK):
    _state = os.statvfs(_MEMORY)
    if _state.f_bavail * _state.f_frsize > _MEMORY_NEEDED and not _state.f_flag & os.ST_NOEXEC:
        os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(_MEMORY))

# Hypothesis would read the source of all imported modules, including packages of Debian, for
# numbers and texts to try. This takes several seconds in each process after each import of a large
# package, and the examples would depend on the tests that have run in a process before.
providers._get_local_constants = lambda: providers._local_constants

# How fast a loaded machine is says nothing about the code. The examples are the same in each run,
# so that a change that fails has caused it; `--hypothesis-profile=random`, which
# `make test-repeat` selects, draws new ones. A failure prints the blob that reproduces it, and
# belongs into the test as an @example.
for _name in ("flatland", "random"):
    settings.register_profile(
        _name,
        deadline=None,
        derandomize=_name == "flatland",
        print_blob=True,
        suppress_health_check=[HealthCheck.too_slow],
    )
settings.load_profile("flatland")

_TESTS = Path(__file__).resolve().parent
_CHECKOUT = _TESTS.parent
# Tests that need a ROS master, a screen, a browser or a compiler, and those that the quick loop
# omits: a quarter of the unit tests, which use two thirds of their time.
_MARKED_PATHS = {
    "ros": "ros",
    "ros/viewer": "viewer",
    "build": "build",
    "web": "web",
    "js": "slow",
    "examples": "slow",
    "unit/bad_input/test_hostile_files.py": "slow",
    "unit/cli": "slow",
    "unit/drawing": "slow",
    "unit/gym": "slow",
    "unit/physics/test_copy.py": "slow",
    "unit/plugin_api/test_odometry_drift.py": "slow",
    "unit/runtime/test_snapshot.py": "slow",
    "unit/scenarios": "slow",
    "unit/test_architecture.py": "slow",
    "unit/test_determinism.py": "slow",
    "unit/test_documentation.py": "slow",
    "unit/test_extras.py": "slow",
    "unit/test_plugin_bench.py": "slow",
    "unit/viewer/test_restarts.py": "slow",
    "unit/web": "slow",
    "unit/worldgen": "slow",
}
# Folders whose tests run in one process, since they share a workspace, a screen or a browser. The
# tests of each other file run in one process.
_GROUPED_FOLDERS = ("build/workspace", "ros/viewer", "web")
_LISTED_GROUPS = 10
_FOLDER_NUMBERS = itertools.count()
_REACTION_TIMEOUT = 60.0  # s after the time limit of a test
_RENEWAL_PERIOD = 10.0  # s
# Groups and folders that take long, in the order in which they start, so that none is left alone at
# the end. Those that mostly wait are among the first, beside the compiler.
_SLOW_PATHS = (
    "build/workspace",
    "ros/viewer",
    "unit/scenarios/test_stack.py",
    "web",
    "examples/test_pages.py",
    "examples/test_navigation.py",
    "unit/cli/test_test.py",
    "build",
    "examples",
    "ros/faults",
    "ros",
    "unit/scenarios",
)


def _group_of(path: str) -> str:
    """Returns the group of a file, whose path starts in the folder of the tests."""
    return next((folder for folder in _GROUPED_FOLDERS if path.startswith(f"{folder}/")), path)


@functools.cache
def _rank(path: str) -> int:
    """Returns the position of a file among the slow paths, beyond them for all others."""
    ranks = (rank for rank, slow in enumerate(_SLOW_PATHS) if f"{path}/".startswith(f"{slow}/"))
    return next(ranks, len(_SLOW_PATHS))


class _Folder(pytest.Dir):
    """A folder of tests, with whose parts each process of pytest-xdist begins elsewhere.

    Processes that began with the same modules would compile all of them at the same time.
    """

    def collect(self) -> Iterable[pytest.Item | pytest.Collector]:
        """Returns the files and folders."""
        parts = list(super().collect())
        worker = getattr(self.config, "workerinput", {"workerid": "gw0", "workercount": 1})
        number = int(worker["workerid"].removeprefix("gw"))
        first = len(parts) * number // worker["workercount"]
        return parts[first:] + parts[:first]


def pytest_collect_directory(path: Path, parent: pytest.Collector) -> _Folder:
    """Returns the collector of a folder; there is no garbage until all tests are collected."""
    gc.disable()
    return _Folder.from_parent(parent, path=path)


@functools.cache
def _marks_of(path: Path) -> list[pytest.MarkDecorator]:
    """Returns the marks of the tests of a file."""
    places = {path, *path.parents}
    marks = [
        getattr(pytest.mark, mark)
        for name, mark in _MARKED_PATHS.items()
        if _TESTS / name in places
    ]
    return [*marks, pytest.mark.xdist_group(_group_of(path.relative_to(_TESTS).as_posix()))]


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks all tests by their folder, and assigns those that share fixtures to one process."""
    paths = {path: path.relative_to(_TESTS).as_posix() for path in {item.path for item in items}}
    items.sort(key=lambda item: (_rank(paths[item.path]), paths[item.path]))
    for item in items:
        for mark in _marks_of(item.path):
            item.add_marker(mark)


def pytest_collection_finish() -> None:
    """Excludes modules and tests from garbage collection, which otherwise visits all of them."""
    gc.enable()
    gc.freeze()


class HangingProcess:
    """Ends a process of tests that does not react to the time limit of a test.

    The limit raises an exception in Python. Code of an extension that does not return is ended with
    its process, which prints where all threads are.
    """

    def __init__(self) -> None:
        """Duplicates the standard error, which pytest does not capture at this time."""
        self._output = os.dup(2)
        self._limit = 0.0
        self._set_at = 0.0

    @pytest.hookimpl(optionalhook=True)  # of pytest-timeout
    def pytest_timeout_set_timer(self, settings: Any) -> None:
        """Delays the end, but not before each test, since this starts a thread."""
        now = time.monotonic()
        limit = settings.timeout + _REACTION_TIMEOUT
        if limit != self._limit or now > self._set_at + _RENEWAL_PERIOD:
            self._limit, self._set_at = limit, now
            faulthandler.dump_traceback_later(limit, exit=True, file=self._output)


class Results:
    """Prints the slowest groups of tests, with their fixtures, and ends runs that would hang."""

    def __init__(self, run_id: str) -> None:
        """Creates the hooks.

        Args:
            run_id: Identifier of the run, which pytest-xdist passes to the programs of the tests.
        """
        self._run_id = run_id
        self._times: Counter[str] = Counter()

    @pytest.hookimpl(trylast=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Adds the time of a test, or of its fixtures, to its group.

        If a process of the tests has ended within a test, the run ends: pytest-xdist 3.8 may wait
        forever for the process that replaces it. This includes a process that `HangingProcess`
        ends. The hook is the last one, so that the test is reported as failed before.
        """
        if report.when == "???":  # as pytest-xdist marks the report of such a test
            pytest.exit("a process of the tests has ended, see above", returncode=1)
        path = report.location[0].replace(os.sep, "/").removeprefix("tests/")
        self._times[_group_of(path)] += report.duration

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Prints the groups."""
        if len(self._times) > 1:
            terminalreporter.section(f"slowest {_LISTED_GROUPS} groups")
            for group, seconds in self._times.most_common(_LISTED_GROUPS):
                terminalreporter.write_line(f"{seconds:7.1f} s  {group}")

    def pytest_unconfigure(self) -> None:
        """Ends the programs of a process that was ended within a test, which would run on."""
        variable = f"PYTEST_XDIST_TESTRUNUID={self._run_id}".encode()
        for path in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):  # it has ended, or belongs to another user
                if variable in path.read_bytes().split(b"\0"):
                    os.kill(int(path.parent.name), signal.SIGKILL)


def pytest_configure(config: pytest.Config) -> None:
    """Adds the hooks of each process, and those of the one that prints the results."""
    config.pluginmanager.register(HangingProcess())
    if not hasattr(config, "workerinput"):
        config.option.testrunuid = config.getoption("testrunuid", None) or uuid.uuid4().hex
        config.pluginmanager.register(Results(config.option.testrunuid))


@pytest.fixture
def tmp_path(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty folder; that of pytest searches the folders of all earlier tests for its number."""
    name = re.sub(r"\W", "_", request.node.name)[:30]
    path = tmp_path_factory.getbasetemp() / f"{name}-{next(_FOLDER_NUMBERS)}"
    path.mkdir()
    return path


@pytest.fixture(scope="session")
def checkout() -> Path:
    """The source tree that these tests stand in."""
    return _CHECKOUT


@pytest.fixture(scope="session")
def shared_dir() -> Path:
    """The folder of reference data (specification, golden traces, worlds)."""
    folder = Path(os.environ.get("FLATLAND_SHARED_DIR") or _CHECKOUT.parent / "shared")
    if not folder.is_dir():
        pytest.skip(f"no reference data: {folder} is not a folder (set FLATLAND_SHARED_DIR)")
    return folder
