"""The part that all environments share: what remains after a failure."""

from __future__ import annotations

from typing import Any, NoReturn

import pytest

from flatland.gym import FlatlandVectorEnv, live_view, stage
from flatland.world import World


class BrokenError(Exception):
    pass


def fail(*_: object, **__: object) -> NoReturn:
    raise BrokenError


@pytest.fixture
def worlds(monkeypatch: pytest.MonkeyPatch) -> list[World]:
    """All worlds that were created."""
    created: list[World] = []
    initialize = World.__init__

    def recorded(self: World, *arguments: Any, **options: Any) -> None:
        initialize(self, *arguments, **options)
        created.append(self)

    monkeypatch.setattr(World, "__init__", recorded)
    return created


@pytest.mark.parametrize("part", ["EpisodeView", "Episodes"])
def test_a_failed_environment_leaves_no_world(
    part: str, worlds: list[World], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, part, fail)
    with pytest.raises(BrokenError):
        FlatlandVectorEnv(3)
    assert worlds
    assert all(world.closed for world in worlds)


def test_a_failed_clone_leaves_no_world(
    worlds: list[World], monkeypatch: pytest.MonkeyPatch
) -> None:
    clone = World.clone

    def clone_once(self: World) -> World:
        return clone(self) if len(worlds) < 2 else fail()

    monkeypatch.setattr(World, "clone", clone_once)
    with pytest.raises(BrokenError):
        FlatlandVectorEnv(4)
    assert [world.closed for world in worlds] == [True, True]


def test_worlds_are_closed_if_their_view_fails_to_close(
    worlds: list[World], monkeypatch: pytest.MonkeyPatch
) -> None:
    envs = FlatlandVectorEnv(2)
    monkeypatch.setattr(live_view.EpisodeView, "close", fail)
    with pytest.raises(BrokenError):
        envs.close()
    assert all(world.closed for world in worlds)


def test_a_world_that_cannot_be_shown_leaves_no_viewer(monkeypatch: pytest.MonkeyPatch) -> None:
    from flatland.web import WebViewer

    add_world = WebViewer.add_world
    shown: list[World] = []

    def add_once(self: WebViewer, world: World, name: str) -> Any:
        if shown:
            fail()
        shown.append(world)
        return add_world(self, world, name)

    monkeypatch.setattr(WebViewer, "add_world", add_once)
    monkeypatch.setenv("FLATLAND_WEB_PORT", "0")
    envs = FlatlandVectorEnv(2, render_mode="human")
    with pytest.raises(BrokenError):
        envs.reset(seed=0)
    assert live_view.SHARED._viewer is None
    envs.close()
