"""Worlds and robots for the tests of the environments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from nested import assert_same

from flatland.gym import FlatlandEnv, FlatlandVectorEnv
from flatland.world import World

Make = Callable[..., Any]

ROBOT = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 0.2, density: 100}]
plugins:
  - {type: DiffDrive, name: drive, body: base}
  - type: Laser
    name: laser
    body: base
    range: 4
    angle: {min: -1.5, max: 1.5, increment: 0.25}
    noise_std_dev: 0.02
"""
WALLS = """
0 0  6 0
6 0  6 4
6 4  0 4
0 4  0 0
"""
WORLD = """
properties: {}
layers: [{name: walls, map: map.yaml}]
models:
  - {name: robot, model: robot.model.yaml, pose: [1, 1, 0]}
"""


@pytest.fixture(autouse=True)
def no_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets the render mode `human` use any free port, and open no browser."""
    monkeypatch.setenv("FLATLAND_WEB_PORT", "0")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A room of 6 m by 4 m with a robot whose laser has 13 beams and noise."""
    (tmp_path / "robot.model.yaml").write_text(ROBOT)
    (tmp_path / "walls.lines").write_text(WALLS)
    (tmp_path / "map.yaml").write_text(
        "type: line_segments\ndata: walls.lines\nscale: 1\norigin: [0, 0, 0]\n"
    )
    path = tmp_path / "world.yaml"
    path.write_text(WORLD)
    return path


@pytest.fixture
def make() -> Iterator[Make]:
    """Creates environments that are closed at the end of the test."""
    made: list[Any] = []

    def create(kind: Callable[..., Any] = FlatlandEnv, *args: Any, **kwargs: Any) -> Any:
        env = kind(*args, **kwargs)
        made.append(env)
        return env

    yield create
    for env in made:
        env.close()


@pytest.fixture
def created(monkeypatch: pytest.MonkeyPatch) -> list[World]:
    """All worlds that were created."""
    worlds: list[World] = []
    initialize = World.__init__

    def recorded(self: World, *arguments: Any, **options: Any) -> None:
        initialize(self, *arguments, **options)
        worlds.append(self)

    monkeypatch.setattr(World, "__init__", recorded)
    return worlds


@pytest.fixture
def equals_singles(make: Make) -> Callable[..., tuple[Any, int]]:
    """Steps a vector and as many single environments, whose results must be the same."""

    def compare(
        n: int,
        steps: int,
        mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        num_threads: int = 3,
        **kwargs: Any,
    ) -> tuple[Any, int]:
        """Returns the vector, and the number of episodes that ended."""
        vector = make(FlatlandVectorEnv, n, autoreset_mode=mode, num_threads=num_threads, **kwargs)
        single = make(SyncVectorEnv, [partial(FlatlandEnv, **kwargs)] * n, autoreset_mode=mode)
        assert vector.observation_space == single.observation_space
        assert vector.action_space == single.action_space
        assert_same(vector.reset(seed=11), single.reset(seed=11))
        vector.action_space.seed(0)
        count = 0
        for _ in range(steps):
            actions = vector.action_space.sample()
            if actions.dtype.kind == "f":
                actions[:, 0] = np.abs(actions[:, 0])  # Mostly forward: episodes end soon.
            result = vector.step(actions)
            assert_same(result, single.step(actions))
            ended = result[2] | result[3]
            count += ended.sum()
            if mode is AutoresetMode.DISABLED and ended.any():
                options = {"reset_mask": ended}
                assert_same(vector.reset(options=options), single.reset(options=options))
        return vector, count

    return compare
