"""The recorded traces that the tests of this folder compare with."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def golden_dir() -> Path:
    """The recorded traces, with their worlds, models and maps; read-only."""
    return Path(__file__).resolve().parent / "data"
