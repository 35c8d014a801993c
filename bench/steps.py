"""Steps in plain Python, without ROS."""

from __future__ import annotations

import os
import statistics

import flatland

from crowd import MAX_ROBOTS, crowd, grid  # isort: skip
from scenes import benchmark_world_path
from table import Row
from timing import best_of
from touching import empty_world, spawn_row

STRIDE = MAX_ROBOTS // 5  # selects five robots
PERIOD = 20  # steps between two scans of a laser
MANY = 1000
TOUCHING = 100


def available_processors() -> int:
    """Returns the number of processors that the process may use."""
    return len(os.sched_getaffinity(0))


def step_time(world: flatland.World, steps: int = 1000, seconds: float = 2.0) -> float:
    """Returns the mean time of a step [s] in the fastest of several runs of `steps` steps."""
    return best_of(lambda: world.step(steps), seconds, 3) / steps


def _free_step(count: int, *, scans: bool) -> float:
    """Returns the time of a step [s] of robots on a grid, far from any wall."""
    with grid(count, scans=scans) as world:
        return step_time(world, PERIOD, 3.0)


def _touching_step(count: int) -> float:
    with empty_world() as world:
        spawn_row(world, count)
        world.step(100)
        return step_time(world, PERIOD, 1.0)


def _step_of_five(first: int) -> float:
    with crowd(slice(first, MAX_ROBOTS, STRIDE), scans=True) as world:
        return step_time(world, 10 * PERIOD, 1.0)


def rows(unit: float) -> list[Row]:
    """Measures steps with one robot, with many, and with the tricycle of the benchmark world."""
    with crowd(slice(1), scans=False) as world:
        alone = step_time(world)
        alone_in_runs = step_time(world, PERIOD)
    free, scanning = _free_step(MANY, scans=False), _free_step(MANY, scans=True)
    touching = _touching_step(TOUCHING)
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
            f"the same, step({PERIOD})",
            alone_in_runs / unit,
            "U",
            0.0006,
            note=_microseconds(alone_in_runs),
        ),
        Row(
            f"step({PERIOD}), {MANY} robots with a drive in free space",
            free / unit,
            "U",
            0.35,
            note=_microseconds(free),
        ),
        Row(
            f"the same with a 360-beam laser at 10 Hz, on {available_processors()} cores",
            scanning / unit,
            "U",
            2.0,
            note=_microseconds(scanning),
        ),
        Row(
            f"step({PERIOD}), {TOUCHING} touching robots with Bumper and BoolSensor",
            touching / unit,
            "U",
            0.5,
            note=_microseconds(touching),
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
