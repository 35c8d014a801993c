"""Steps in plain Python, without ROS."""

from __future__ import annotations

import os

import flatland

from crowd import MAX_ROBOTS, crowd, grid  # isort: skip
from scenes import benchmark_world_path
from table import Row
from timing import Mean, mean_of
from touching import empty_world, spawn_row

STRIDE = MAX_ROBOTS // 5  # selects five robots
PERIOD = 20  # steps between two scans of a laser
MANY = 1000
TOUCHING = 100


def available_processors() -> int:
    """Returns the number of processors that the process may use."""
    return len(os.sched_getaffinity(0))


def step_time(world: flatland.World, steps: int = 1000, seconds: float = 2.0) -> Mean:
    """Returns the time of a step in runs of `steps` steps."""
    return mean_of(lambda: world.step(steps), seconds) / steps


def _free_step(count: int, *, scans: bool) -> Mean:
    """Returns the time of a step of robots on a grid, far from any wall."""
    with grid(count, scans=scans) as world:
        return step_time(world, PERIOD, 3.0)


def _touching_step(count: int) -> Mean:
    with empty_world() as world:
        spawn_row(world, count)
        world.step(100)
        return step_time(world, PERIOD)


def _step_of_five() -> Mean:
    """Returns the time of a step of five robots, at several places."""
    times = []
    for first in range(0, STRIDE, STRIDE // 5):
        with crowd(slice(first, MAX_ROBOTS, STRIDE), scans=True) as world:
            times.append(step_time(world, 10 * PERIOD).seconds)
    return Mean.of(times)


def rows(unit: float) -> list[Row]:
    """Measures steps with one robot, with many, and with the tricycle of the benchmark world."""
    with crowd(slice(1), scans=False) as world:
        alone = step_time(world)
        alone_in_runs = step_time(world, PERIOD)
    free, scanning = _free_step(MANY, scans=False), _free_step(MANY, scans=True)
    touching = _touching_step(TOUCHING)
    few = _step_of_five()
    with crowd(slice(MAX_ROBOTS), scans=True) as world:
        many = step_time(world, PERIOD)
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        world.step(100)
        tricycle = step_time(world)
    return [
        Row(
            "step in Python, one differential drive, no outputs wanted",
            alone.seconds / unit,
            "U",
            0.004,
            note=_microseconds(alone),
        ),
        Row(
            f"the same, step({PERIOD})",
            alone_in_runs.seconds / unit,
            "U",
            0.0006,
            note=_microseconds(alone_in_runs),
        ),
        Row(
            f"step({PERIOD}), {MANY} robots with a drive in free space",
            free.seconds / unit,
            "U",
            0.35,
            note=_microseconds(free),
        ),
        Row(
            f"the same with a 360-beam laser at 10 Hz, on {available_processors()} cores",
            scanning.seconds / unit,
            "U",
            2.0,
            note=_microseconds(scanning),
        ),
        Row(
            f"step({PERIOD}), {TOUCHING} touching robots with Bumper and BoolSensor",
            touching.seconds / unit,
            "U",
            0.5,
            note=_microseconds(touching),
        ),
        Row(
            "step in Python, benchmark world, laser computed",
            tricycle.seconds / unit,
            "U",
            note=_microseconds(tricycle),
        ),
        Row(
            "step in Python, 5 robots with a 360-beam laser at 10 Hz",
            few.seconds / unit,
            "U",
            note=_microseconds(few),
        ),
        Row(
            f"step in Python, {MAX_ROBOTS} robots with a 360-beam laser at 10 Hz",
            many.seconds / unit,
            "U",
            0.4,
            note=f"{_microseconds(many)}; reference simulator: 3.5 U",
        ),
        Row(
            f"step of {MAX_ROBOTS} robots, relative to 5 robots",
            many.seconds / few.seconds,
            "times",
            20.0,
        ),
    ]


def _microseconds(step: Mean) -> str:
    return f"{step.seconds * 1e6:.1f} µs, {step.rate}"
