"""Robots in contact with each other, with a Bumper and a BoolSensor each."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import flatland

RADIUS = 0.2  # m
SPACING = 0.398  # m, an overlap below the tolerance of the Box2D solver: contacts persist
TURN = 0.5  # rad/s; without friction a body turns forever and never falls asleep

WORLD = "{properties: {}, layers: [{name: 2d}]}"
ROBOT = f"""
bodies:
  - name: base
    footprints: [{{type: circle, radius: {RADIUS}, density: 50}}]
plugins:
  - {{type: Bumper, name: bumper}}
  - {{type: BoolSensor, name: touch}}
"""


@contextmanager
def empty_world() -> Iterator[flatland.World]:
    """A world without models, beside a model file `robot.yaml`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.yaml").write_text(ROBOT)
        (folder / "world.yaml").write_text(WORLD)
        with flatland.World.from_yaml(folder / "world.yaml", seed=1) as world:
            yield world


def spawn_row(world: flatland.World, count: int) -> None:
    """Spawns robots in a row, each in contact with its neighbors, that turn in place."""
    for index in range(count):
        name = f"robot{index}"
        model = world.spawn_model("robot.yaml", name, name, (SPACING * index, 0.0, 0.0))
        model.bodies[0].set_velocity(0.0, 0.0, TURN)
