"""Drags pause the world, and let it run on when they end."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import flatland
from flatland.ros.interactive.drag import LONGEST_SILENCE, Drags

POSE = (1.0, 2.0, 3.0)


@pytest.fixture
def world() -> Iterator[flatland.World]:
    with flatland.World(seed=1) as world:
        yield world


def test_world_is_paused_while_anything_is_dragged(world: flatland.World) -> None:
    drags = Drags(world)
    drags.hold("a", "rviz", 0.0, POSE)
    drags.hold("b", "other", 0.0, POSE)
    assert (world.paused, bool(drags)) == (True, True)
    drags.end("a")
    assert world.paused
    drags.end("b")
    assert (world.paused, bool(drags)) == (False, False)


def test_world_that_was_paused_before_stays_so(world: flatland.World) -> None:
    world.pause()
    drags = Drags(world)
    drags.hold("a", "rviz", 0.0, POSE)
    drags.hold("a", "rviz", 0.1, POSE)
    drags.end("a")
    assert world.paused


def test_pause_by_somebody_who_resumed_during_a_drag_stays(world: flatland.World) -> None:
    drags = Drags(world)
    drags.hold("a", "rviz", 0.0, POSE)
    world.resume()
    drags.hold("a", "rviz", 0.1, POSE)
    assert not world.paused
    world.pause()
    drags.end("a")
    assert world.paused


def test_silent_drags_end(world: flatland.World) -> None:
    drags = Drags(world)
    drags.hold("a", "rviz", 0.0, POSE)
    drags.hold("b", "rviz", 0.05, POSE)
    assert drags.end_silent(LONGEST_SILENCE) == []
    assert drags.end_silent(LONGEST_SILENCE + 0.01) == ["a"]
    assert world.paused
    drags.hold("b", "rviz", 0.15, POSE)
    assert drags.end_silent(0.2) == []
    assert drags.end_silent(0.3) == ["b"]
    assert not world.paused


def test_end_of_what_is_not_dragged_changes_nothing(world: flatland.World) -> None:
    drags = Drags(world)
    drags.end("a")
    world.pause()
    drags.end("a")
    assert world.paused
