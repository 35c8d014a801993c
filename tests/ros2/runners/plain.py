"""Carries out the script of commands without ROS: plain.py WORLD SEED RESULT."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from command_script import run_script

import flatland


class PlainClient:
    """Carries out commands by methods of a world."""

    def __init__(self, world: flatland.World) -> None:
        self._world = world

    def drive(self, linear: float, angular: float) -> None:
        self._world.command("/cmd_vel").set(flatland.Twist(linear, 0.0, angular))

    def step(self, duration: float) -> None:
        self._world.step(round(duration / self._world.timekeeper.step_size))

    def move(self, model: str, pose: Sequence[float]) -> None:
        self._world.move_model(model, pose)

    def spawn(self, file: str, name: str, pose: Sequence[float]) -> None:
        self._world.spawn_model(file, name, "", pose)

    def delete(self, model: str) -> None:
        self._world.delete_model(model)

    def reset(self, seed: int) -> None:
        self._world.reset(seed=seed)

    def probe(self) -> str:
        return str(self._world.plugins[0].probe())


_, path, seed, result = sys.argv
with flatland.World.from_yaml(path, seed=int(seed)) as world:
    run_script(PlainClient(world), Path(result))
