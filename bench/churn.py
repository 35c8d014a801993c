"""Steps of a robot in a world in which many models were spawned and deleted before it."""

from __future__ import annotations

from table import Row
from timing import best_pair
from touching import empty_world

import flatland

MODELS = 10_000
STEPS = 20_000  # per measurement
ROBOT = """
bodies:
  - {{name: base, footprints: [{{type: circle, radius: 0.2, density: 50}}]}}
plugins:
  - {{type: DiffDrive, name: drive, body: base, pub_rate: {rate}}}
"""


def _spawn(world: flatland.World, name: str, rate: float) -> None:
    """Spawns a robot from a text, with outputs at a rate [Hz]."""
    world.spawn_model(ROBOT.format(rate=rate), name, name)


def _spawn_and_delete(world: flatland.World) -> None:
    """Spawns, steps and deletes models one after the other; no two of them have the same rate."""
    for number in range(MODELS):
        _spawn(world, "visitor", 0.5 + number / 100)
        world.step()
        world.delete_model("visitor")


def rows(unit: float) -> list[Row]:
    """Compares a world after the models are gone with a world that never had them."""
    with empty_world() as untouched, empty_world() as used:
        _spawn_and_delete(used)
        untouched.step(MODELS)  # so that both robots start at the same time
        for world in (untouched, used):
            _spawn(world, "robot", 0.123)
            world.command("/robot/cmd_vel").set(flatland.Twist(linear_x=0.2, angular_z=1.0))
            world.step()
        without, after = best_pair(lambda: untouched.step(STEPS), lambda: used.step(STEPS), 2.0)
    name = f"step after {MODELS} spawns and deletions with distinct rates, relative to none"
    step = after / STEPS
    note = f"{step * 1e6:.2f} µs, {step / unit:.2g} U"
    return [Row(name, after / without, "times", 1.1, note=note)]
