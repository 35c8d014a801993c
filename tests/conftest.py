"""Fixtures for all tests."""

from __future__ import annotations

import functools
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# How fast a loaded machine is says nothing about the code. The examples are new in each run, also
# in CI: a failure prints the blob that reproduces it, and belongs into the test as an @example.
settings.register_profile(
    "flatland",
    deadline=None,
    derandomize=False,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("flatland")

_TESTS = Path(__file__).resolve().parent
_CHECKOUT = _TESTS.parent
# Tests that need a ROS master, a screen or a compiler, and take a while.
_MARKED_FOLDERS = {"ros": "ros", "ros/viewer": "viewer", "build": "build", "web": "web"}
# Folders whose tests run in one process, since they share a workspace or a screen. The tests of
# each other file run in one process.
_GROUPED_FOLDERS = ("build", "ros/viewer")


@functools.cache
def _marks_of(path: Path) -> list[pytest.MarkDecorator]:
    """Returns the marks of the tests of a file."""
    folders = [folder for folder in _MARKED_FOLDERS if _TESTS / folder in path.parents]
    marks = [getattr(pytest.mark, _MARKED_FOLDERS[folder]) for folder in folders]
    group = next((f for f in _GROUPED_FOLDERS if _TESTS / f in path.parents), None)
    return [*marks, pytest.mark.xdist_group(group or str(path.relative_to(_TESTS)))]


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks all tests by their folder, and assigns those that share fixtures to one process."""
    for item in items:
        for mark in _marks_of(item.path):
            item.add_marker(mark)


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
