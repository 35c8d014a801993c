"""Fixtures for all tests."""

from __future__ import annotations

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
_MARKED_FOLDERS = {"ros": "ros", "ros/viewer": "viewer", "build": "build"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Gives all tests of a folder the marker of the folder."""
    for item in items:
        for folder, marker in _MARKED_FOLDERS.items():
            if _TESTS / folder in item.path.parents:
                item.add_marker(marker)


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
