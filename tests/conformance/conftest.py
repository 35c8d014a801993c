"""Fixtures of the conformance tests."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def golden_dir() -> Path:
    """Folder of the recorded traces with their worlds, models and maps; read-only."""
    return Path(__file__).resolve().parent / "data"
