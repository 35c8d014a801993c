"""Cost over the number of beams, edges, robots and pixels: the curves of docs/performance.md."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import flatland
from flatland.physics import PhysicsWorld, boundary_edges

import lasers  # isort: skip
from crowd import MAX_ROBOTS, crowd  # isort: skip
from curves import Curve, Panel
from large_map import load, write_world
from scans import add_crowd
from scenes import beam_ends, benchmark_world_path, random_map, scan_pose, world_of_edges
from steps import PERIOD, step_time
from timing import best_of
from touching import empty_world, spawn_row

ALL = 0xFFFF
BEAM_COUNTS = (8, 30, 100, 300, 1081, 3000, 10_000)
BOX_COUNTS = (250, 1000, 4000, 15_000, 60_000, 250_000)
MOVING_COUNTS = (1, 10, 30, 100, 300, 1000)
ROBOT_COUNTS = (1, 2, 5, 10, 20, 50, MAX_ROBOTS)
TOUCHING_COUNTS = (25, 50, 100, 200, 400)
SPAWNS = 5  # of which the fastest counts
SIDES = (1000, 2000, 4000, 10_000)
SCAN, LOOP = "flatland", "b2World::RayCast"


def panels() -> list[Panel]:
    """Measures all curves."""
    scans = [_beams(), _edges(), _moving(), lasers.panel()]
    return [*scans, _robots(), _touching(), _spawning(), _loading()]


def _compare(
    physics: PhysicsWorld, pose: tuple[float, float, float], beams: int
) -> tuple[float, float]:
    """Returns the times of one scan with `cast_rays` and with `b2World::RayCast` [µs]."""
    ends = beam_ends(beams)
    batch = best_of(lambda: physics.cast_rays(pose, ends, ALL), 0.2)
    loop = best_of(lambda: physics.cast_rays_reference(pose, ends, ALL), 0.2, 3)
    return 1e6 * batch, 1e6 * loop


def _scan_panel(
    title: str, x_label: str, x: Sequence[float], pairs: list[Sequence[float]]
) -> Panel:
    batch, loop = zip(*pairs, strict=True)
    curves = [Curve(SCAN, list(x), list(batch)), Curve(LOOP, list(x), list(loop))]
    return Panel(title, x_label, "time of a scan [µs]", curves)


def _beams() -> Panel:
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        world.step()
        pose = scan_pose(world)
        pairs = [_compare(world.physics, pose, count) for count in BEAM_COUNTS]
    return _scan_panel("A scan of the benchmark world", "beams", BEAM_COUNTS, pairs)


def _edges() -> Panel:
    counts, pairs = [], []
    for boxes in BOX_COUNTS:
        # The density of boxes is constant: only the number of occluded edges grows.
        side = int(4000 * (boxes / 60_000) ** 0.5)
        edges = boundary_edges(random_map(side, boxes), 0.05)
        physics = world_of_edges(edges)
        middle = 0.025 * side
        pairs.append(_compare(physics, (middle, middle, 0.0), 1081))
        counts.append(len(edges))
        physics.close()
    return _scan_panel("1081 beams, maps of increasing size", "edges", counts, pairs)


def _moving() -> Panel:
    pairs = []
    for count in MOVING_COUNTS:
        with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
            add_crowd(world, count)
            world.physics.step(1e-6, 1, 1)
            pairs.append(_compare(world.physics, scan_pose(world), 1081))
    title = "1081 beams, moving bodies with two shapes nearby"
    return _scan_panel(title, "bodies", MOVING_COUNTS, pairs)


def _robots() -> Panel:
    curves = []
    for label, scans in (("with a 360-beam laser at 10 Hz", True), ("laser not wanted", False)):
        times = []
        for count in ROBOT_COUNTS:
            with crowd(slice(count), scans=scans) as world:
                times.append(1e6 * step_time(world, 10 * PERIOD, 0.5).seconds)
        curves.append(Curve(label, list(ROBOT_COUNTS), times))
    return Panel(
        "A step of robots with a differential drive", "robots", "time of a step [µs]", curves
    )


def _touching() -> Panel:
    curves = []
    for label, wanted in (("outputs wanted", True), ("outputs not wanted", False)):
        times = []
        for count in TOUCHING_COUNTS:
            with empty_world() as world:
                spawn_row(world, count)
                for topic in world.ports.outputs if wanted else ():
                    world.output(topic)
                world.step(10)
                times.append(1e3 * step_time(world, PERIOD, 0.5).seconds)
        curves.append(Curve(label, list(TOUCHING_COUNTS), times))
    return Panel(
        "A step of touching robots, Bumper and BoolSensor",
        "robots",
        "time of a step [ms]",
        curves,
    )


def _spawning() -> Panel:
    times = [min(_spawn_time(count) for _ in range(SPAWNS)) for count in TOUCHING_COUNTS]
    curves = [Curve("World.spawn_model", list(TOUCHING_COUNTS), times)]
    return Panel("Spawning robots with Bumper and BoolSensor", "robots", "time [s]", curves)


def _spawn_time(count: int) -> float:
    """Returns the time [s] in which some robots are spawned into an empty world."""
    with empty_world() as world:
        start = time.perf_counter()
        spawn_row(world, count)
        return time.perf_counter() - start


def _loading() -> Panel:
    times, peaks, pixels = [], [], []
    for side in SIDES:
        with tempfile.TemporaryDirectory() as folder:
            loading, _, peak, _ = load(write_world(Path(folder), side))
        pixels.append(side**2 / 1e6)
        times.append(loading)
        peaks.append(peak / 1000)
    curves = [Curve("time [s]", pixels, times), Curve("peak memory [GB]", pixels, peaks)]
    return Panel("Loading a world", "map size [million pixels]", "", curves)
