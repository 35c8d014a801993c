"""Sonar: nearest distance in a cone, limits, noise, materials, frames and rates."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import flatland
from flatland import Range

SONAR = "type: Sonar, name: sonar, body: base, range: 5, field_of_view: 0.5"
NO_LAYERS = "footprints: [{type: circle, radius: 0.2, density: 1, layers: []}]"
BODIES = f"[{{name: base, {NO_LAYERS}}}]"

Collect = Callable[[flatland.World, str], list[Any]]
Load = Callable[..., flatland.World]


@pytest.fixture
def sonar_world(plugin_world: Any) -> Load:
    """Loads a world with a sonar at the origin that looks along x, with more parameters."""

    def load(more: str = "", **options: Any) -> flatland.World:
        return plugin_world(f"[{{{SONAR}{more}}}]", **{"bodies": BODIES, **options})

    return load


def add_disc(world: flatland.World, x: float, y: float, radius: float) -> None:
    body = world.physics.create_body("static", (x, y, 0))
    body.create_circle((0, 0), radius, density=0)


@pytest.mark.parametrize(
    ("entry", "expected"), [("", math.inf), (", no_hit: range", 5.0), (", no_hit: nan", math.nan)]
)
def test_an_empty_cone(sonar_world: Load, entry: str, expected: float) -> None:
    world = sonar_world(entry, namespace="r1")
    reading = world.output("/r1/range")
    world.step()
    assert reading.latest.range == pytest.approx(expected, nan_ok=True)
    if not entry:
        assert reading.latest == Range(0, "r1_sonar", "ultrasound", 0.5, 0.0, 5.0, math.inf)


@pytest.mark.parametrize("bearing", [0.0, 0.1, -0.2, 0.24])
def test_the_range_is_that_of_the_nearest_point_in_the_cone(
    sonar_world: Load, bearing: float
) -> None:
    world = sonar_world()
    reading = world.output("/range")
    add_disc(world, 4 * math.cos(bearing), 4 * math.sin(bearing), 0.5)
    # Nothing outside of the cone is detected.
    for side in (-1, 1):
        add_disc(world, 3 * math.cos(0.25), side * (3 * math.sin(0.25) + 0.11), 0.1)
    world.step()
    # The nearest point of the disc is on the line to its centre; rays are at most 4 mrad apart.
    assert reading.latest.range == pytest.approx(3.5, abs=1e-4)


def test_a_wall_at_an_angle_is_measured_at_the_edge_of_the_cone(sonar_world: Load) -> None:
    world = sonar_world()
    reading = world.output("/range")
    # The plane with the normal at the angle a and the distance 1 m: r = 1 / cos(angle - a).
    a = 0.8
    p = np.array([math.cos(a), math.sin(a)])
    t = np.array([-p[1], p[0]])
    wall = world.physics.create_body("static", (0, 0, 0))
    wall.create_edges([[*(p - 9 * t), *(p + 9 * t)]])
    world.step()
    assert reading.latest.range == pytest.approx(1 / math.cos(0.25 - a), abs=1e-5)


def test_an_object_of_the_given_size_is_found_everywhere(sonar_world: Load) -> None:
    world = sonar_world(", smallest_object: 0.05")
    reading = world.output("/range")
    disc = world.physics.create_body("kinematic", (0, 0, 0))
    disc.create_circle((0, 0), 0.025, density=0)
    for bearing in np.linspace(-0.25, 0.25, 97):
        disc.set_pose(4.97 * math.cos(bearing), 4.97 * math.sin(bearing), 0)
        world.step()
        assert reading.latest.range == pytest.approx(4.96, abs=0.0151)


def test_the_origin_and_the_transform(sonar_world: Load) -> None:
    more = ", origin: [0, 0.5, 1.5707963], frame: eye, range_min: 0.5"
    world = sonar_world(more, pose=(1, 0, math.pi / 2))
    reading = world.output("/range")
    add_disc(world, -3, 0, 0.5)  # The sensor is at (0.5, 0) and looks along -x.
    world.step()
    assert reading.latest.range == pytest.approx(3.0, abs=1e-4)
    transform = world.transforms["base", "eye"]
    assert (transform.x, transform.y, transform.yaw) == pytest.approx((0, 0.5, 1.5707963))
    add_disc(world, 0.1, 0, 0.2)  # closer than the least range
    world.step()
    assert (reading.latest.range, reading.latest.min_range) == (-math.inf, 0.5)


def test_only_its_layers_are_detected(sonar_world: Load) -> None:
    world = sonar_world(", layers: [3d]")
    reading = world.output("/range")
    for x, bits in ((2, 1), (4, 2)):
        body = world.physics.create_body("static", (x, 0, 0))
        body.create_circle((0, 0), 0.5, density=0, category_bits=bits)
    world.step()
    assert reading.latest.range == pytest.approx(3.5, abs=1e-4)


def test_glass_stops_ultrasound_and_lets_infrared_pass(plugin_world: Any) -> None:
    world = plugin_world(
        f"[{{{SONAR}, topic: us}}, {{{SONAR.replace('name: sonar', 'name: ir')},"
        " radiation_type: infrared, topic: ir}]",
        bodies=BODIES,
    )
    ultrasound, infrared = world.output("/us"), world.output("/ir")
    pane = world.physics.create_body("static", (0, 0, 0))
    pane.create_edges([[2, -5, 2, 5]])
    pane.set_material(flatland.Material(transmission=1.0))
    add_disc(world, 4, 0, 0.5)
    world.step()
    assert ultrasound.latest.range == pytest.approx(2.0, abs=1e-4)
    assert infrared.latest.range == pytest.approx(3.5, abs=1e-4)
    assert infrared.latest.radiation_type == "infrared"


def test_noise_is_that_of_one_reading(sonar_world: Load, collect: Collect) -> None:
    world = sonar_world(", noise_std_dev: 0.1")
    readings = collect(world, "/range")
    add_disc(world, 4, 0, 0.5)
    world.step(2000)
    errors = np.array([reading.range for reading in readings]) - 3.5
    assert abs(errors.mean()) < 5 * 0.1 / math.sqrt(2000)
    assert errors.std() == pytest.approx(0.1, rel=0.08)
