"""Laser in worlds with materials: scans, intensities, and all ways to change a world."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.plugins.laser import Laser, compute_scans

LASER = "{type: Laser, name: l, body: base, range: 9, angle: {min: -0.5, max: 0.5, increment: 0.01}"
BODIES = "[{name: base, footprints: [{type: circle, radius: 0.2, density: 1, layers: []}]}]"
PANE = """
bodies:
  - name: pane
    type: kinematic
    footprints:
      - {type: polygon, points: [[0, -4], [0.1, -4], [0.1, 4], [0, 4]], density: 0,
         material: {transmission: 0.5, specular: 0.25}}
"""

Collect = Callable[[flatland.World, str], list[Any]]


@pytest.fixture
def glass_world(plugin_world: Any) -> Callable[..., flatland.World]:
    """Loads a robot with a laser at the origin, walls around it, and a pane at x = 2."""

    def load(more: str = "", *, spawn: bool = True) -> flatland.World:
        plugin_world.files.write_map("walls", ["#" * 12] + ["#" + "." * 10 + "#"] * 10 + ["#" * 12])
        plugin_world.files.write("pane.model.yaml", PANE)
        world: flatland.World = plugin_world(
            f"[{LASER}{more}}}]",
            bodies=BODIES,
            layers="[{name: 2d, map: walls.yaml}, {name: 3d}]",
            pose=(6, 6, 0),
        )
        if spawn:
            world.spawn_model("pane.model.yaml", "pane", pose=(8, 6, 0))
        return world

    return load


def contents(scans: list[Any]) -> list[tuple[int, bytes, bytes]]:
    return [(scan.stamp, scan.ranges.tobytes(), scan.intensities.tobytes()) for scan in scans]


def test_shares_of_beams(glass_world: Any, collect: Collect) -> None:
    world = glass_world()
    scans = collect(world, "/scan")
    world.step(50)
    angles = np.arange(101) * 0.01 - 0.5
    x = np.array([scan.ranges for scan in scans]) * np.cos(angles)
    # The pane is at 2 m and the wall at 5 m; the image of the wall behind, at -5 m, is at 9 m.
    shares = [(np.abs(x - distance) < 0.01).mean() for distance in (2, 5)]
    deviation = math.sqrt(0.25 / x.size)
    assert shares == pytest.approx([0.25, 0.5], abs=5 * deviation)
    assert np.isnan(x).mean() + (x > 5.01).mean() == pytest.approx(0.25, abs=5 * deviation)
    assert all((scan.intensities[np.isnan(scan.ranges)] == 0).all() for scan in scans)


def test_intensities_exist_only_while_there_are_materials(
    glass_world: Any, collect: Collect
) -> None:
    world = glass_world(spawn=False)
    scans = collect(world, "/scan")
    laser = world.model("robot").plugin("l")
    world.step()
    world.spawn_model("pane.model.yaml", "pane", pose=(8, 6, 0))
    world.step()
    assert laser.intensities.shape == (101,)
    world.move_model("pane", (3, 6, 0))
    world.step()
    world.delete_model("pane")
    world.step()
    assert [len(scan.intensities) for scan in scans] == [0, 101, 101, 0]
    assert laser.intensities.shape == (0,)
    assert scans[0].ranges.tobytes() == scans[2].ranges.tobytes() == scans[3].ranges.tobytes()
    assert scans[0].ranges.tobytes() != scans[1].ranges.tobytes()


def test_paused_worlds_snapshots_clones_and_resets(glass_world: Any, collect: Collect) -> None:
    world = glass_world(", noise_std_dev: 0.02, update_rate: 50")
    scans = collect(world, "/scan")
    world.step(20)
    snapshot = world.snapshot()
    world.step(20)
    expected = contents(scans[-5:])
    assert len({ranges for _, ranges, _ in expected}) == 5
    world.delete_model("pane")
    world.restore(snapshot)
    assert world.physics.has_materials
    world.step(20)
    assert contents(scans[-5:]) == expected
    world.restore(snapshot)
    with world.clone() as clone:
        cloned = collect(clone, "/scan")
        world.delete_model("pane")
        assert not world.physics.has_materials
        clone.step(20)
        assert contents(cloned[-5:]) == expected
    world.reset()
    world.spawn_model("pane.model.yaml", "pane", pose=(8, 6, 0))
    world.step(40)
    assert contents(scans[-5:]) == expected


def test_computed_scans_differ_from_call_to_call(glass_world: Any) -> None:
    world = glass_world()
    laser = world.model("robot").plugin("l")
    assert isinstance(laser, Laser)
    first, second = laser.compute_ranges(), laser.compute_ranges()
    assert first.tobytes() != second.tobytes()
    again = glass_world().model("robot").plugin("l")
    assert compute_scans([again])[0].tobytes() == first.tobytes()
    assert compute_scans([again])[0].tobytes() == second.tobytes()


def test_a_world_without_materials_has_no_random_scans(glass_world: Any) -> None:
    laser = glass_world(spawn=False).model("robot").plugin("l")
    assert laser.compute_ranges().tobytes() == laser.compute_ranges().tobytes()
    assert laser.state() is None
