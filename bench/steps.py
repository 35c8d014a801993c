"""Steps in plain Python, without ROS."""

from __future__ import annotations

import statistics

import flatland

from crowd import MOST, crowd  # isort: skip
from scenes import benchmark_world_path
from table import Row
from timing import best_of

STRIDE = MOST // 5  # every so many robots make five
PERIOD = 20  # steps, in which each laser scans once


def step_time(world: flatland.World, steps: int = 1000, seconds: float = 2.0) -> float:
    """Returns the time of one step [s], the mean over so many in the best run."""
    return best_of(lambda: world.step(steps), seconds, 3) / steps


def _step_of_five(first: int) -> float:
    with crowd(slice(first, MOST, STRIDE), scans=True) as world:
        return step_time(world, 10 * PERIOD, 1.0)


def rows(unit: float) -> list[Row]:
    """Measures steps with one robot, with many, and with the benchmark's tricycle."""
    with crowd(slice(1), scans=False) as world:
        alone = step_time(world)
    few = statistics.mean(map(_step_of_five, range(0, STRIDE, STRIDE // 5)))
    with crowd(slice(MOST), scans=True) as world:
        many = step_time(world, PERIOD)
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        world.step(100)
        tricycle = step_time(world)
    return [
        Row(
            "step in Python, one differential drive in an office, no outputs",
            alone / unit,
            "U",
            0.004,
            note=_microseconds(alone),
        ),
        Row(
            "step in Python, benchmark_world, laser computed",
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
            "step in Python, 100 such robots",
            many / unit,
            "U",
            0.4,
            note=f"{_microseconds(many)}; the reference 3.5 U",
        ),
        Row("step of 100 robots over that of 5", many / few, "times", 20.0),
    ]


def _microseconds(seconds: float) -> str:
    return f"{seconds * 1e6:.1f} µs, {1 / seconds:.0f} steps a second"
