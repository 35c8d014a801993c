"""Prints hashes of runs of all included worlds, for comparisons of two systems.

    .venv/bin/python tools/state_hashes.py >hashes.txt

Each line contains the name of a world, a number of steps, the state hash after them, and a hash of
all values that the outputs had until then. In each world, all drives with a topic of velocities
drive. Two systems on which all results are the same print the same lines.
"""

from __future__ import annotations

from pathlib import Path

import flatland
from flatland.runtime.state_hash import StateHasher

_WORLDS = Path(__file__).resolve().parent.parent / "worlds"
_STEPS = (1, 10, 100, 1000, 5000)


def print_hashes(path: Path) -> None:
    """Runs a world file and prints one line for each of the numbers of steps."""
    outputs = StateHasher()
    with flatland.World.from_yaml(str(path), seed=1) as world:
        for topic, output in world.ports.outputs.items():
            output.subscribe(lambda value, topic=topic: outputs.add((topic, value)))
        for topic in world.ports.commands:
            command = world.command(topic)
            if command.value_type is flatland.Twist:
                command.set(flatland.Twist(linear_x=0.5, angular_z=0.2))
        done = 0
        for steps in _STEPS:
            world.step(steps - done)
            done = steps
            print(path.parent.name, steps, world.state_hash(), outputs.hexdigest(), flush=True)


def main() -> None:
    """Runs all worlds."""
    for path in sorted(_WORLDS.glob("*/world.yaml")):
        print_hashes(path)


if __name__ == "__main__":
    main()
