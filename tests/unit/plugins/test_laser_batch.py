"""Scans of many lasers in one call."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.errors import StaleHandleError
from flatland.plugins.laser import cast_scans, compute_scans
from flatland.runtime.plugin_costs import PluginCosts

ROOM = ["#" * 12, *["#" + "." * 10 + "#"] * 10, "#" * 12]
LAYERS = "[{name: 2d}, {name: reflectance, map: room.yaml}]"
FAN = "{min: -3, max: 3, increment: 0.02}"
OTHER_FAN = "{min: 2, max: -2, increment: -0.05}"
NOISE = "noise_model: beam, z_short: 0.1, z_rand: 0.1, sigma_hit: 0.2, lambda_short: 0.5"
LASERS = f"""
- {{type: Laser, name: eye, body: base, range: 9, angle: {FAN}, noise_std_dev: 0.05}}
- {{type: Laser, name: rear, body: base, range: 9, angle: {OTHER_FAN}, {NOISE}, topic: rear}}
- {{type: Laser, name: exact, body: base, range: 9, angle: {FAN}, topic: exact}}
"""


class Robots:
    """Loads worlds with three robots, each with three lasers."""

    def __init__(self, plugin_world: Any) -> None:
        self._load = plugin_world

    def world(self, seed: int = 1) -> flatland.World:
        self._load.files.write_map("room", ROOM)
        world: flatland.World = self._load(LASERS, layers=LAYERS, pose=(3.0, 4.0, 0.5), seed=seed)
        for index, pose in enumerate([(7.0, 3.0, 2.0), (5.0, 8.0, -1.0)]):
            world.spawn_model("robot.model.yaml", f"robot{index}", f"ns{index}", pose)
        return world

    def lasers(self, world: flatland.World) -> list[Any]:
        names = ("eye", "rear", "exact")
        return [model.plugin(name) for model in world.models for name in names]


@pytest.fixture
def robots(plugin_world: Any) -> Robots:
    return Robots(plugin_world)


def description(laser: Any) -> tuple[Any, ...]:
    """Returns everything that a scan changes in a laser."""
    pose, ranges = laser.last_scan
    return pose, ranges.tobytes(), laser.intensities.tobytes(), laser.state()


@pytest.mark.parametrize("threads", [0, 1, 2, 5])
def test_a_batch_equals_single_scans(robots: Robots, threads: int) -> None:
    together, alone = robots.world(), robots.world()
    for _ in range(3):
        lasers, others = robots.lasers(together), robots.lasers(alone)
        ranges = compute_scans(lasers, num_threads=threads)
        expected = [laser.compute_ranges() for laser in others]
        for got, right in zip(ranges, expected, strict=True):
            np.testing.assert_array_equal(got, right)
        assert list(map(description, lasers)) == list(map(description, others))
        assert together.state_hash() == alone.state_hash()
        together.step(2)
        alone.step(2)
    assert any((laser.intensities == 255).any() for laser in lasers)


def test_lasers_of_several_worlds(robots: Robots) -> None:
    seeds = (1, 2, 3)
    lasers = [laser for seed in seeds for laser in robots.lasers(robots.world(seed))]
    others = [laser for seed in seeds for laser in robots.lasers(robots.world(seed))]
    compute_scans(lasers[::-1])
    for laser in others:
        laser.compute_ranges()
    assert list(map(description, lasers)) == list(map(description, others))


def test_a_laser_that_occurs_twice_has_two_scans(robots: Robots) -> None:
    laser, other = robots.lasers(robots.world())[0], robots.lasers(robots.world())[0]
    ranges = compute_scans([laser, laser])
    np.testing.assert_array_equal(ranges, [other.compute_ranges(), other.compute_ranges()])
    assert (ranges[0] != ranges[1]).any()
    assert description(laser) == description(other)


def test_no_lasers() -> None:
    assert compute_scans([]) == []
    cast_scans([])


def test_ranges_are_written_to_an_array(robots: Robots) -> None:
    lasers = robots.lasers(robots.world())[::3]
    expected = compute_scans(robots.lasers(robots.world())[::3])
    out = np.zeros((3, len(expected[0])), np.float32)
    for part in (slice(0, 1), slice(1, 3)):
        ranges = compute_scans(lasers[part], out[part])
        assert all(np.shares_memory(row, out) for row in ranges)
    np.testing.assert_array_equal(out, expected)


def test_a_failed_batch_changes_nothing(robots: Robots) -> None:
    world, other = robots.world(), robots.world()
    lasers, others = robots.lasers(world), robots.lasers(other)
    before = world.state_hash()
    with pytest.raises(ValueError, match="num_threads"):
        compute_scans(lasers, num_threads=-1)
    with pytest.raises(ValueError, match="the same number of beams"):
        compute_scans(lasers, np.zeros((9, 301), np.float32))
    with pytest.raises(TypeError, match="float32"):
        compute_scans(lasers[:1], np.zeros((1, 301)))  # type: ignore[arg-type]
    assert world.state_hash() == before
    assert all(laser.last_scan is None for laser in lasers)
    other.close()
    with pytest.raises(StaleHandleError):
        compute_scans([*lasers, *others])
    assert world.state_hash() == before


class TestEmittedScans:
    def emitted(self, lasers: list[Any]) -> list[Any]:
        """Subscribes to the scans of lasers."""
        found: list[Any] = []
        for laser in lasers:
            laser._output.subscribe(found.append)
        return found

    def test_scans_that_are_cast_together_equal_single_ones(self, robots: Robots) -> None:
        found = []
        for together in (True, False):
            world = robots.world()
            scans = self.emitted(robots.lasers(world))
            # Wall times are attributed to each plugin, so that nothing is done together.
            world.plugin_host.costs = None if together else PluginCosts()
            for _ in range(3):
                world.step()
                for laser in robots.lasers(world):
                    laser.compute_ranges()  # has no effect on what is emitted
            assert len(scans) == 27
            found.append([(s.frame_id, s.ranges.tobytes(), s.intensities.tobytes()) for s in scans])
        assert found[0] == found[1]

    def test_only_wanted_scans_are_cast(self, robots: Robots) -> None:
        world = robots.world()
        first = robots.lasers(world)[0]
        world.output(first._output.topic)
        world.step(3)
        assert first.last_scan is not None
        assert all(laser.last_scan is None for laser in robots.lasers(world)[1:])

    def test_an_error_of_one_laser_does_not_affect_the_others(self, robots: Robots) -> None:
        world = robots.world()
        scans = self.emitted(robots.lasers(world))
        broken = robots.lasers(world)[4]
        broken._finder = None
        with pytest.raises(AttributeError) as caught:
            world.step()
        assert f'Model Plugin "{broken.name}"' in caught.value.__notes__[0]
        assert len(scans) == 8


def test_random_seeds_differ(robots: Robots) -> None:
    first, second = (robots.lasers(robots.world(seed))[0].compute_ranges() for seed in (1, 2))
    assert not math.isnan(first[0])
    assert (first != second).mean() > 0.9
