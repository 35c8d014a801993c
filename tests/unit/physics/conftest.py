"""Fixtures of the tests of the physics engine."""

from __future__ import annotations

import pytest

from flatland.physics import PhysicsWorld


@pytest.fixture
def world() -> PhysicsWorld:
    """An empty world."""
    return PhysicsWorld()
