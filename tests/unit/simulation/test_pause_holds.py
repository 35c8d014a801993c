"""Pauses that several clients share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import flatland
from flatland.simulation import PauseHolds


@pytest.fixture
def world() -> Iterator[flatland.World]:
    with flatland.World(seed=1) as world:
        yield world


def test_the_last_of_several_clients_resumes_the_world(world: flatland.World) -> None:
    holds = PauseHolds(world)
    for client in ("rviz", "page", "page"):
        holds.hold(client)
        assert world.paused
    assert holds
    holds.release("rviz")
    assert world.paused, "the page still holds the world"
    holds.release("rviz")
    assert world.paused
    holds.release("page")
    assert not world.paused
    assert not holds


def test_a_world_that_was_paused_remains_paused(world: flatland.World) -> None:
    world.pause()
    holds = PauseHolds(world)
    holds.hold("page")
    holds.release("page")
    assert world.paused


def test_a_pause_after_a_resume_during_a_hold_remains(world: flatland.World) -> None:
    holds = PauseHolds(world)
    holds.hold("page")
    world.resume()
    holds.check()
    world.pause()
    holds.release("page")
    assert world.paused


def test_a_pause_by_other_means_during_a_hold_remains(world: flatland.World) -> None:
    holds = PauseHolds(world)
    holds.hold("page")
    world.pause()
    holds.keep_paused()
    holds.release("page")
    assert world.paused
