"""Work without ROS that versions are compared by: python work.py ROW

Prints `ready`; for each line of the input, performs a part of the work, and prints the processor
time of one operation [s]. Uses nothing that earlier versions do not have.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import flatland

# Of the earlier version, since later ones read its files, but it may not read theirs.
OFFICE_VARIABLE = "FLATLAND_BENCH_OFFICE"
OFFICE = Path(
    os.environ.get(OFFICE_VARIABLE) or Path(__file__).resolve().parents[1] / "worlds" / "office"
)
PART = 0.2  # processor time of a part of the work [s]

ROBOT = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 0.2, density: 50}]
plugins:
  - {type: DiffDrive, name: drive, body: base}
  - {type: Laser, name: laser, body: base, range: 20, noise_std_dev: 0.01,
     angle: {min: -3.14, max: 3.13, increment: 0.0174}}
"""
WORLD = f"""
properties: {{}}
layers: [{{name: walls, map: {OFFICE / "office.yaml"}}}]
models: [{{name: robot, model: robot.model.yaml, pose: [-3, -5.5, 0]}}]
"""
OUTPUTS = ("/scan", "/odometry/filtered", "/odometry/ground_truth", "/twist")

Work = tuple[Callable[[], object], int]
"""A function, and the number of operations that it performs."""


@contextlib.contextmanager
def robot_folder() -> Iterator[Path]:
    """Creates a folder with `world.yaml`, a robot in the office, and `robot.model.yaml`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "world.yaml").write_text(WORLD)
        (folder / "robot.model.yaml").write_text(ROBOT)
        yield folder


@contextlib.contextmanager
def robot_world(*, wanted: bool) -> Iterator[flatland.World]:
    """Loads a driving robot in the office; its outputs and transforms are wanted or not."""
    with (
        robot_folder() as folder,
        flatland.World.from_yaml(folder / "world.yaml", seed=1) as world,
    ):
        world.command("/cmd_vel").set(flatland.Twist(linear_x=0.1, angular_z=0.5))
        if wanted:
            for topic in OUTPUTS:
                world.output(topic)
        world.step(10)
        yield world


@contextlib.contextmanager
def office() -> Iterator[flatland.World]:
    """Loads the office of a checkout, with a driving robot."""
    with flatland.World.from_yaml(OFFICE / "world.yaml", seed=1) as world:
        world.command("/cmd_vel").set(flatland.Twist(linear_x=0.5))
        world.output("/scan")
        world.step(40)
        yield world


@contextlib.contextmanager
def _steps(count: int, *, wanted: bool) -> Iterator[Work]:
    with robot_world(wanted=wanted) as world:
        yield lambda: world.step(count), count


@contextlib.contextmanager
def _spawn() -> Iterator[Work]:
    with robot_folder() as folder, robot_world(wanted=False) as world:

        def spawn() -> None:
            world.spawn_model(folder / "robot.model.yaml", "new", "new", (3.0, -5.5, 0.0))
            world.delete_model("new")

        yield spawn, 1


@contextlib.contextmanager
def _snapshot() -> Iterator[Work]:
    with office() as world:
        yield world.snapshot, 1


@contextlib.contextmanager
def _restore() -> Iterator[Work]:
    with office() as world:
        snapshot = world.snapshot()
        yield lambda: world.restore(snapshot), 1


@contextlib.contextmanager
def _clone() -> Iterator[Work]:
    with office() as world:
        yield lambda: world.clone().close(), 1


@contextlib.contextmanager
def _reset() -> Iterator[Work]:
    with office() as world:
        yield world.reset, 1


@contextlib.contextmanager
def _vector(count: int) -> Iterator[Work]:
    import flatland.gym

    envs = flatland.gym.make_vec("flatland/Navigate-v0", count)
    envs.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (200, count, 2)).astype(np.float32)
    for action in actions[:100]:  # The first episodes begin at the same time.
        envs.step(action)
    rest = itertools.cycle(actions)
    yield lambda: envs.step(next(rest)), count
    envs.close()


ROWS: dict[str, Callable[[], contextlib.AbstractContextManager[Work]]] = {
    "step(1), DiffDrive and Laser, outputs wanted": lambda: _steps(1, wanted=True),
    "step(1), DiffDrive and Laser, nothing wanted": lambda: _steps(1, wanted=False),
    "step(200), DiffDrive and Laser, outputs wanted": lambda: _steps(200, wanted=True),
    "step(200), DiffDrive and Laser, nothing wanted": lambda: _steps(200, wanted=False),
    "step of one of 64 environments": lambda: _vector(64),
    "spawn and delete of a robot": _spawn,
    "snapshot of the office": _snapshot,
    "restore of the office": _restore,
    "clone and close of the office": _clone,
    "reset of the office": _reset,
}


def measure(action: Callable[[], object], operations: int) -> float:
    """Returns the processor time of one operation in a part of the work [s]."""
    calls, start = 0, time.process_time()
    while (elapsed := time.process_time() - start) < PART:
        action()
        calls += 1
    return elapsed / (calls * operations)


def main() -> None:
    """Performs parts of the work of a row until the input ends."""
    with ROWS[sys.argv[1]]() as (action, operations):
        action()
        print("ready", flush=True)
        for _ in sys.stdin:
            print(measure(action, operations), flush=True)


if __name__ == "__main__":
    main()
