"""Steps of a fleet spawned at random positions, partly inside walls, and of one free robot."""

from __future__ import annotations

import math
import time

import numpy as np

import flatland
from flatland.physics import PhysicsWorld

from scenes import benchmark_world_path  # isort: skip
from table import Row
from timing import best_of

ROBOTS = 50
FLEETS = 3
STEPS = 3000
RUNS = 3  # of each fleet
STEP = (0.005, 10, 10)
SPEED = 0.5  # m/s


def _fleet_times(seed: int) -> np.ndarray:
    """Returns the processor time of each step of a fleet [s]."""
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as source:
        edges = source.layers[0].edges
    world = PhysicsWorld()
    world.create_body("static", (0, 0, 0)).create_edges(edges)
    rng = np.random.default_rng(seed)
    corners = edges.reshape(-1, 2)
    positions = rng.uniform(corners.min(0), corners.max(0), (ROBOTS, 2)).tolist()
    robots = []
    for x, y in positions:
        robot = world.create_body("dynamic", (x, y, float(rng.uniform(-3, 3))))
        robot.create_circle((0, 0), 0.2, density=10)
        robots.append((robot, float(rng.uniform(-1, 1))))
    world.find_new_contacts()  # as `World.from_yaml` does
    times = []
    for _ in range(STEPS):
        for robot, omega in robots:
            theta = robot.pose[2]
            robot.set_velocity(SPEED * math.cos(theta), SPEED * math.sin(theta), omega)
        start = time.thread_time()
        world.step(*STEP)
        times.append(time.thread_time() - start)
    return np.array(times)


def _plain_step_time() -> float:
    world = PhysicsWorld()
    world.create_body("static", (0, 0, 0)).create_edges([(-1, -1, 1, -1)])
    body = world.create_body("dynamic", (0, 0, 0))
    body.create_circle((0, 0), 0.2, density=10)

    def steps() -> None:
        for _ in range(1000):
            body.set_velocity(0.3, 0, 0.1)
            world.step(*STEP)

    return best_of(steps, 1.0) / 1000


def rows(unit: float) -> list[Row]:
    """Measures fleets at three sets of random positions, and one robot without contacts."""
    # All runs of a fleet are identical, so the minimum of each step removes disturbances.
    fleets = [np.min([_fleet_times(seed) for _ in range(RUNS)], axis=0) for seed in range(FLEETS)]
    worst = max(float(times.max()) for times in fleets)
    median = max(float(np.median(times)) for times in fleets)
    plain = _plain_step_time()
    return [
        Row(
            f"slowest step of {ROBOTS} robots spawned at random",
            worst / unit,
            "U",
            2.0,
            note=f"{worst * 1e3:.2f} ms of processor time, first step included; median: "
            f"{median * 1e3:.2f} ms, maximum of {FLEETS} fleets",
        ),
        Row(
            "step of PhysicsWorld, one robot without contacts",
            plain / unit,
            "U",
            note=f"{plain * 1e6:.2f} µs",
        ),
    ]
