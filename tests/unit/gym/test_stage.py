"""The part that all environments share: what remains after their end or a failure."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

import pytest
from gymnasium.error import ClosedEnvironmentError

from flatland.gym import (
    FlatlandEnv,
    FlatlandVectorEnv,
    FleetVectorEnv,
    live_view,
    make_parallel,
    stage,
)
from flatland.world import World


class BrokenError(Exception):
    pass


def fail(*_: object, **__: object) -> NoReturn:
    raise BrokenError


@pytest.mark.parametrize("kind", [FlatlandEnv, FlatlandVectorEnv, make_parallel, FleetVectorEnv])
def test_a_closed_environment_is_of_no_use(make: Callable[..., Any], kind: Any) -> None:
    env = make(kind)
    env.reset(seed=0)
    env.close()
    env.close()
    for use in (lambda: env.step({}), env.reset, env.render):
        with pytest.raises(ClosedEnvironmentError, match="closed"):
            use()


@pytest.mark.parametrize("part", ["EpisodeView", "Episodes"])
def test_a_failed_environment_leaves_no_world(
    part: str, created: list[World], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, part, fail)
    with pytest.raises(BrokenError):
        FlatlandVectorEnv(3)
    assert created
    assert all(world.closed for world in created)


@pytest.fixture
def collector() -> Iterator[None]:
    """Restores the state of the collector of garbage."""
    yield
    gc.enable()


@pytest.mark.usefixtures("collector")
@pytest.mark.parametrize("is_enabled", [True, False])
def test_the_collector_is_paused_while_worlds_are_copied(
    make: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, is_enabled: bool
) -> None:
    """It would examine all of them again and again."""
    clone = World.clone
    seen = []

    def observed_clone(self: World) -> World:
        seen.append(gc.isenabled())
        return clone(self) if len(seen) < 3 else fail()

    monkeypatch.setattr(World, "clone", observed_clone)
    (gc.enable if is_enabled else gc.disable)()
    make(FlatlandVectorEnv, 2)
    assert gc.isenabled() == is_enabled
    with pytest.raises(BrokenError):
        make(FlatlandVectorEnv, 4)
    assert gc.isenabled() == is_enabled
    assert seen == [False] * 3


def test_a_failed_clone_leaves_no_world(
    created: list[World], monkeypatch: pytest.MonkeyPatch
) -> None:
    clone = World.clone

    def clone_once(self: World) -> World:
        return clone(self) if len(created) < 2 else fail()

    monkeypatch.setattr(World, "clone", clone_once)
    with pytest.raises(BrokenError):
        FlatlandVectorEnv(4)
    assert [world.closed for world in created] == [True, True]


def test_worlds_are_closed_if_their_view_fails_to_close(
    created: list[World], monkeypatch: pytest.MonkeyPatch
) -> None:
    envs = FlatlandVectorEnv(2)
    monkeypatch.setattr(live_view.EpisodeView, "close", fail)
    with pytest.raises(BrokenError):
        envs.close()
    assert all(world.closed for world in created)


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
