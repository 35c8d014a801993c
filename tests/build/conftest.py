"""A world for the tests of builds and of installations."""

from __future__ import annotations

from pathlib import Path

import pytest

WORLD = """
properties: {}
layers: []
models: [{name: ball, model: ball.yaml, pose: [1, 2, 0]}]
"""
MODEL = """
bodies:
  - name: base
    footprints: [{type: circle, radius: $eval 0.1 * 2, density: 1}]
"""


@pytest.fixture(scope="session")
def world_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A world with one ball and no map; its model file contains a Lua expression."""
    folder = tmp_path_factory.mktemp("world")
    (folder / "ball.yaml").write_text(MODEL)
    path = folder / "world.yaml"
    path.write_text(WORLD)
    return path
