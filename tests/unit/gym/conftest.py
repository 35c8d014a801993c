"""Worlds and robots for the tests of the environments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import flatland.gym

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

    def create(
        kind: Callable[..., Any] = flatland.gym.FlatlandEnv, *args: Any, **kwargs: Any
    ) -> Any:
        env = kind(*args, **kwargs)
        made.append(env)
        return env

    yield create
    for env in made:
        env.close()
