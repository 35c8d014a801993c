"""Fixtures for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# How fast a loaded machine is says nothing about the code; CI draws the same examples every time.
settings.register_profile(
    "flatland",
    deadline=None,
    derandomize=bool(os.environ.get("CI")),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("flatland")

_CHECKOUT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def checkout() -> Path:
    """The source tree that these tests stand in."""
    return _CHECKOUT


@pytest.fixture(scope="session")
def shared_dir() -> Path:
    """The folder of reference data (specification, golden traces, worlds)."""
    folder = Path(os.environ.get("FLATLAND_SHARED_DIR") or _CHECKOUT.parent / "shared")
    if not folder.is_dir():
        pytest.skip(f"no reference data: {folder} is no folder (FLATLAND_SHARED_DIR names another)")
    return folder
