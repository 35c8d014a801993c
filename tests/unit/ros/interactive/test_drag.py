"""Pausing and resuming of the world by drags."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import flatland
from flatland.ros.interactive.drag import DRAG_TIMEOUT, Drags
from flatland.simulation import PauseHolds

POSE = (1.0, 2.0, 3.0)


@pytest.fixture
def world() -> Iterator[flatland.World]:
    with flatland.World(seed=1) as world:
        yield world


def test_world_is_paused_during_drags(world: flatland.World) -> None:
    drags = Drags(PauseHolds(world))
    drags.hold("a", "rviz", 0.0, POSE)
    drags.hold("b", "other", 0.0, POSE)
    assert (world.paused, bool(drags)) == (True, True)
    drags.end("a")
    assert world.paused
    drags.end("b")
    assert (world.paused, bool(drags)) == (False, False)


def test_world_paused_before_a_drag_remains_paused(world: flatland.World) -> None:
    world.pause()
    drags = Drags(PauseHolds(world))
    drags.hold("a", "rviz", 0.0, POSE)
    drags.hold("a", "rviz", 0.1, POSE)
    drags.end("a")
    assert world.paused


def test_world_resumed_and_paused_during_a_drag_remains_paused(world: flatland.World) -> None:
    drags = Drags(PauseHolds(world))
    drags.hold("a", "rviz", 0.0, POSE)
    world.resume()
    drags.hold("a", "rviz", 0.1, POSE)
    assert not world.paused
    world.pause()
    drags.end("a")
    assert world.paused


def test_stale_drags_end(world: flatland.World) -> None:
    drags = Drags(PauseHolds(world))
    drags.hold("a", "rviz", 0.0, POSE)
    drags.hold("b", "rviz", 0.05, POSE)
    assert drags.end_stale(DRAG_TIMEOUT) == []
    assert drags.end_stale(DRAG_TIMEOUT + 0.01) == ["a"]
    assert world.paused
    drags.hold("b", "rviz", 0.15, POSE)
    assert drags.end_stale(0.2) == []
    assert drags.end_stale(0.3) == ["b"]
    assert not world.paused


def test_end_without_a_drag_has_no_effect(world: flatland.World) -> None:
    drags = Drags(PauseHolds(world))
    drags.end("a")
    world.pause()
    drags.end("a")
    assert world.paused
