"""Steps in plain Python, without ROS."""

from __future__ import annotations

import statistics

import flatland

from crowd import MAX_ROBOTS, crowd  # isort: skip
from scenes import benchmark_world_path
from table import Row
from timing import best_of

STRIDE = MAX_ROBOTS // 5  # selects five robots
PERIOD = 20  # steps between two scans of a laser


def step_time(world: flatland.World, steps: int = 1000, seconds: float = 2.0) -> float:
    """Returns the mean time of a step [s] in the fastest of several runs of `steps` steps."""
    return best_of(lambda: world.step(steps), seconds, 3) / steps


def _step_of_five(first: int) -> float:
    with crowd(slice(first, MAX_ROBOTS, STRIDE), scans=True) as world:
        return step_time(world, 10 * PERIOD, 1.0)


def rows(unit: float) -> list[Row]:
    """Measures steps with one robot, with many, and with the tricycle of the benchmark world."""
    with crowd(slice(1), scans=False) as world:
        alone = step_time(world)
    few = statistics.mean(map(_step_of_five, range(0, STRIDE, STRIDE // 5)))
    with crowd(slice(MAX_ROBOTS), scans=True) as world:
        many = step_time(world, PERIOD)
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        world.step(100)
        tricycle = step_time(world)
    return [
        Row(
            "step in Python, one differential drive, no outputs wanted",
            alone / unit,
            "U",
            0.004,
            note=_microseconds(alone),
        ),
        Row(
            "step in Python, benchmark world, laser computed",
            tricycle / unit,
            "U",
            note=_microseconds(tricycle),
        ),
        Row(
            "step in Python, 5 robots with a 360-beam laser at 10 Hz",
            few / unit,
            "U",
            note=_microseconds(few),
        ),
        Row(
            f"step in Python, {MAX_ROBOTS} robots with a 360-beam laser at 10 Hz",
            many / unit,
            "U",
            0.4,
            note=f"{_microseconds(many)}; reference simulator: 3.5 U",
        ),
        Row(f"step of {MAX_ROBOTS} robots, relative to 5 robots", many / few, "times", 20.0),
    ]


def _microseconds(seconds: float) -> str:
    return f"{seconds * 1e6:.1f} µs, {1 / seconds:.0f} steps per second"
