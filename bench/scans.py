"""Scans: `cast_rays`, compared with a C++ loop over `b2World::RayCast` in the same run."""

from __future__ import annotations

import math

import numpy as np

import flatland
from flatland.physics import PhysicsWorld, boundary_edges
from flatland.plugins.laser import Laser

from scenes import (  # isort: skip
    BEAMS,
    beam_ends,
    benchmark_world_path,
    random_map,
    scan_pose,
    world_of_edges,
)
from table import Row
from timing import best_pair

ALL = 0xFFFF


def compare(physics: PhysicsWorld, pose: tuple[float, float, float]) -> tuple[float, float]:
    """Returns the times of one scan with `cast_rays` and with `b2World::RayCast` [s]."""
    ends = beam_ends()
    return best_pair(
        lambda: physics.cast_rays(pose, ends, ALL),
        lambda: physics.cast_rays_reference(pose, ends, ALL),
    )


def time_unit() -> float:
    """Returns U [s]: a scan of 1081 beams with `b2World::RayCast` in the benchmark world."""
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        world.step()
        return compare(world.physics, scan_pose(world))[1]


def add_crowd(world: flatland.World, count: int) -> None:
    """Adds moving robots, each with a circle and a polygon, around the first model."""
    x, y, _ = scan_pose(world)
    rng = np.random.default_rng(2)
    for index in range(count):
        angle = 2 * math.pi * index / count
        distance = rng.uniform(1.5, 8.0)
        pose = (x + distance * math.cos(angle), y + distance * math.sin(angle), angle)
        body = world.physics.create_body("dynamic", pose)
        body.create_circle((0.1, 0.0), 0.2, density=1.0)
        body.create_polygon([(-0.2, -0.1), (0.0, -0.1), (0.0, 0.1), (-0.2, 0.1)], density=1.0)
        body.set_velocity(*rng.uniform(-0.1, 0.1, 3))


def _row(name: str, times: tuple[float, float], bar: float) -> Row:
    batch, reference = times
    note = f"{BEAMS / batch / 1e6:.1f} and {BEAMS / reference / 1e6:.2f} million rays per second"
    return Row(name, reference / batch, "times b2World::RayCast", bar, True, note)


def _whole_scan(world: flatland.World) -> Row:
    """Measures a scan with noise and limits, as a plugin computes it."""
    laser = next(p for p in world.models[0].plugins if isinstance(p, Laser))
    times = best_pair(
        laser.compute_ranges,
        lambda: world.physics.cast_rays_reference(scan_pose(world), beam_ends(), ALL),
    )
    beams = laser.angles.count
    note = f"{times[0] * 1e6:.1f} µs, {beams} beams"
    ratio = times[1] / times[0] * beams / BEAMS
    return Row("whole scan with noise", ratio, "times b2World::RayCast", 60.0, True, note)


def rows(_unit: float) -> list[Row]:
    """Measures scans in a static map, among moving robots and in a large map."""
    found = []
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        world.step()
        times = compare(world.physics, scan_pose(world))
        found.append(
            Row(
                "scan of 1081 beams, relative to b2World::RayCast",
                times[0] / times[1],
                "",
                1.05,
                note=f"{times[0] * 1e6:.0f} µs and {times[1] * 1e6:.0f} µs",
            )
        )
        found.append(_row("rays, static map", times, 70.0))
        found.append(_whole_scan(world))
        add_crowd(world, 50)
        world.step()
        found.append(_row("rays, 50 moving robots", compare(world.physics, scan_pose(world)), 50.0))
    edges = boundary_edges(random_map(4000, 60_000), 0.05)
    physics = world_of_edges(edges)
    physics.step(0.005, 8, 3)
    times = compare(physics, (100.0, 100.0, 0.0))
    found.append(_row(f"rays, 4000 x 4000 px map with {len(edges)} edges", times, 60.0))
    physics.close()
    return found
