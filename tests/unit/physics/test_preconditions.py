"""Preconditions of Box2D: a violation raises an exception instead of aborting the process, and the
world remains usable.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from flatland.errors import PhysicsError
from flatland.physics import PhysicsBody, PhysicsWorld

NAN = float("nan")
INF = float("inf")
BAD_NUMBERS = [NAN, INF, -INF, 1e30]


@pytest.fixture
def world(world: PhysicsWorld) -> Iterator[PhysicsWorld]:
    yield world
    # The world can still be stepped after an error.
    world.step(0.01, 10, 10)


@pytest.fixture
def body(world: PhysicsWorld) -> PhysicsBody:
    body = world.create_body("dynamic", (0, 0, 0))
    body.create_circle((0, 0), 1.0, density=1.0)
    return body


def rejected(text: str) -> Any:
    return pytest.raises(ValueError, match=re.escape(text))


@pytest.mark.parametrize("bad", BAD_NUMBERS)
@pytest.mark.parametrize(
    "call",
    [
        lambda world, _, bad: world.create_body("dynamic", (bad, 0, 0)),
        lambda world, _, bad: world.create_body("dynamic", (0, bad, 0)),
        lambda world, _, bad: world.create_body("dynamic", (0, 0, bad)),
        lambda world, _, bad: world.create_body("static", (0, 0, 0), linear_damping=abs(bad)),
        lambda world, _, bad: world.create_body("static", (0, 0, 0), angular_damping=abs(bad)),
        lambda _, body, bad: body.set_pose(bad, 0, 0),
        lambda _, body, bad: body.set_pose(0, 0, bad),
        lambda _, body, bad: body.set_velocity(0, bad, 0),
        lambda _, body, bad: body.set_velocity(0, 0, bad),
        lambda _, body, bad: body.apply_force((bad, 0), (0, 0)),
        lambda _, body, bad: body.apply_force((0, 0), (0, bad)),
        lambda _, body, bad: body.apply_torque(bad),
        lambda _, body, bad: body.create_circle((0, bad), 1.0, density=1.0),
        lambda _, body, bad: body.create_circle((0, 0), abs(bad), density=1.0),
        lambda _, body, bad: body.create_circle((0, 0), 1.0, density=abs(bad)),
        lambda _, body, bad: body.create_circle((0, 0), 1.0, density=1.0, friction=abs(bad)),
        lambda _, body, bad: body.create_circle((0, 0), 1.0, density=1.0, restitution=abs(bad)),
        lambda _, body, bad: body.create_polygon([(0, 0), (1, 0), (0, bad)], density=1.0),
        lambda _, body, bad: body.create_edges([[0, 0, 1, bad]]),
        lambda world, _, bad: world.ray_cast((0, bad), (1, 0)),
        lambda world, _, bad: world.ray_cast((0, 0), (bad, 0)),
        lambda world, _, bad: world.cast_rays((bad, 0, 0), [[1, 0]], 0xFFFF),
        lambda world, _, bad: world.cast_rays((0, 0, bad), [[1, 0]], 0xFFFF),
        lambda world, _, bad: world.cast_rays((0, 0, 0), [[1, 0], [1, bad]], 0xFFFF),
        lambda world, _, bad: world.cast_rays_reference((0, 0, 0), [[1, bad]], 0xFFFF),
        lambda world, _, bad: world.step(bad, 10, 10),
    ],
)
def test_numbers_must_be_finite(
    world: PhysicsWorld,
    body: PhysicsBody,
    call: Callable[[PhysicsWorld, PhysicsBody, float], object],
    bad: float,
) -> None:
    with pytest.raises(ValueError, match=r"must be (finite|from)|too large"):
        call(world, body, bad)


@pytest.mark.parametrize("bad", [NAN, INF])
def test_joint_numbers_must_be_finite(world: PhysicsWorld, body: PhysicsBody, bad: float) -> None:
    other = world.create_body("dynamic", (0, 0, 0))
    with rejected("anchor_a must be finite"):
        world.create_revolute_joint(body, other, (bad, 0), (0, 0))
    with rejected("anchor_b must be finite"):
        world.create_weld_joint(body, other, (0, 0), (0, bad))
    with rejected("lower limit must be finite"):
        world.create_revolute_joint(body, other, (0, 0), (0, 0), limits=(bad, 1.0))
    for name in ("reference_angle", "frequency", "damping"):
        with rejected(f"{name} must be finite"):
            world.create_weld_joint(body, other, (0, 0), (0, 0), **{name: bad})


def test_error_messages_contain_the_index_of_an_invalid_number(body: PhysicsBody) -> None:
    with rejected("edges[1, 2] must be finite and within +-1e+09, got nan"):
        body.create_edges([[0, 0, 1, 1], [0, 0, NAN, 0]])
    assert len(body.fixtures) == 1, "no edge is created"
    with rejected("points[2] must be finite and within +-1e+09, got (0, inf)"):
        body.create_polygon([(0, 0), (1, 0), (0, INF)], density=1.0)


def test_values_must_not_be_negative(world: PhysicsWorld, body: PhysicsBody) -> None:
    other = world.create_body("dynamic", (0, 0, 0))
    for name in ("linear_damping", "angular_damping"):
        with rejected(f"{name} must not be negative, got -0.5"):
            world.create_body("dynamic", (0, 0, 0), **{name: -0.5})
    for name in ("radius", "density", "restitution"):
        with rejected(f"{name} must not be negative, got -1"):
            body.create_circle((0, 0), **{"radius": 1, "density": 1, name: -1})
    with rejected("friction must not be negative"):
        body.create_edges([[0, 0, 1, 1]], friction=-1)
    for name in ("frequency", "damping"):
        with rejected(f"{name} must not be negative"):
            world.create_weld_joint(body, other, (0, 0), (0, 0), **{name: -1})
    with rejected("iterations must not be negative, got -1"):
        world.step(0.01, -1, 10)


@pytest.mark.parametrize("dt", [0.0, -0.01, 1e-9, 1e6])
def test_time_steps_must_be_in_range(world: PhysicsWorld, dt: float) -> None:
    with rejected("dt must be from 1e-6 to 1000 s, got"):
        world.step(dt, 10, 10)


def test_body_types_must_be_known(world: PhysicsWorld) -> None:
    with rejected('body_type must be one of: static, kinematic, dynamic, got "soft"'):
        world.create_body("soft", (0, 0, 0))


@pytest.mark.parametrize("bits", [-1, 0x10000])
def test_bits_must_fit_into_16_bits(world: PhysicsWorld, body: PhysicsBody, bits: int) -> None:
    with rejected(f"category_bits must be from 0 to 65535, got {bits}"):
        body.create_circle((0, 0), 1, density=1, category_bits=bits)
    with rejected(f"mask_bits must be from 0 to 65535, got {bits}"):
        body.create_edges([[0, 0, 1, 1]], mask_bits=bits)
    with rejected(f"mask must be from 0 to 65535, got {bits}"):
        world.cast_rays((0, 0, 0), [[1, 0]], bits)
    with rejected(f"reflect_mask must be from 0 to 65535, got {bits}"):
        world.cast_rays((0, 0, 0), [[1, 0]], 1, bits)
    with rejected(f"category_bits must be from 0 to 65535, got {bits}"):
        body.fixtures[0].category_bits = bits


def test_arrays_must_have_the_right_shape(world: PhysicsWorld, body: PhysicsBody) -> None:
    with rejected("ends must have shape (n, 2), got (5, 3)"):
        world.cast_rays((0, 0, 0), np.zeros((5, 3)), 1)
    with rejected("ends must have shape (n, 2), got (4,)"):
        world.cast_rays((0, 0, 0), np.zeros(4), 1)
    with rejected("edges must have shape (n, 4), got (5, 3)"):
        body.create_edges(np.zeros((5, 3)))
    with rejected("points must have shape (n, 2), got (5, 3)"):
        body.create_polygon(np.zeros((5, 3)), density=1)


@pytest.mark.parametrize("count", [0, 1, 2, 9, 20])
def test_polygons_must_have_3_to_8_points(body: PhysicsBody, count: int) -> None:
    angles = np.linspace(0, 6, count)
    with rejected(f"a polygon must have 3 to 8 points, got {count}"):
        body.create_polygon(np.stack([np.cos(angles), np.sin(angles)], 1), density=1)


def test_polygon_points_must_be_distinct(body: PhysicsBody) -> None:
    # Box2D drops points that are closer than 2.5 mm to a point that it has kept.
    for points in (
        [(0, 0), (0, 0), (1, 0)],
        [(0, 0), (0.0024, 0), (1, 0)],
        [(0, 0), (0.0024, 0), (1, 0), (1.0017, 0.0017)],
    ):
        with rejected("at least 3 points that are at least 2.5 mm apart, got 2"):
            body.create_polygon(points, density=1)
    body.create_polygon([(0, 0), (0.0026, 0), (0, 0.0026)], density=1)


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0), (1, 0), (2, 0)],
        [(0, 0), (1, 1), (2, 2), (3, 3)],
        [(-1, 3), (0, 1), (1, -1)],
        [(0, 0), (1000, 1000), (500, 500.0001)],
        [(1e8, 1e8), (1e8 + 100, 1e8 + 100), (1e8 + 200, 1e8 + 200)],
    ],
)
def test_polygons_must_have_area(body: PhysicsBody, points: list[tuple[float, float]]) -> None:
    with rejected("a polygon must have a positive area, but its points are collinear"):
        body.create_polygon(points, density=1)


def test_no_polygon_aborts_the_process(world: PhysicsWorld) -> None:
    """Nearly degenerate polygons of all sizes are either created or rejected."""
    rng = np.random.default_rng(7)
    made = 0
    for _ in range(1500):
        count = rng.integers(3, 9)
        size = 10 ** rng.uniform(-3, 6)
        along = rng.uniform(-size, size, count)
        points = np.stack([along, along * rng.uniform(-1, 1)], 1)
        points += rng.normal(0, size * 10 ** rng.uniform(-9, -1), (count, 2))
        points += rng.choice([0, 1, 1000]) * size
        body = world.create_body("dynamic", (0, 0, 0))
        try:
            body.create_polygon(points, density=10 ** rng.uniform(-6, 6))
            made += 1
        except ValueError:
            pass
        body.destroy()
    assert made > 150


def test_a_polygon_is_the_convex_hull_of_its_points(body: PhysicsBody) -> None:
    square = [(0, 0), (2, 0), (1, 1), (2, 2), (0, 2), (1, 1)]
    vertices = body.create_polygon(square, density=1).vertices
    assert sorted(map(tuple, vertices.tolist())) == [(0, 0), (0, 2), (2, 0), (2, 2)]


def test_the_central_inertia_must_not_be_negligible(world: PhysicsWorld) -> None:
    body = world.create_body("dynamic", (0, 0, 0))
    with rejected("a shape may be too small and too far from the origin of the body"):
        body.create_circle((10000, 0), 0.01, density=1)
    with rejected("the mass of a body must be 0 or from 1e-20 to 1e15 kg"):
        body.create_circle((0, 0), 1e6, density=1e9)
    assert body.mass == 1
    assert body.fixtures == []
    # The mass of a static body is irrelevant.
    world.create_body("static", (0, 0, 0)).create_circle((10000, 0), 0.01, density=1)


def test_circles_without_radius_are_points(world: PhysicsWorld) -> None:
    """Such footprints are valid: they add no mass, walls stop them, and the solver is stable."""
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[1, -1, 1, 1]])
    wall.create_circle((1.5, 0), 0, density=1)
    bodies = [world.create_body("dynamic", (x, 0, 0)) for x in (0, 0, 1.2)]
    for body in bodies:
        body.create_circle((0, 0), 0, density=1)
        assert (body.mass, body.inertia) == (1, 0)
        body.set_velocity(1, 0, 0)
    for _ in range(300):
        world.step(0.01, 10, 10)
    assert [body.pose for body in bodies] == [pytest.approx((1, 0, 0), abs=0.1)] * 2 + [
        pytest.approx((1.2 + 3, 0, 0), abs=0.1)
    ]


def test_forces_must_be_in_range_for_the_mass(world: PhysicsWorld) -> None:
    light = world.create_body("dynamic", (0, 0, 0))
    light.create_circle((0, 0), 0.01, density=1e-9)
    for force, point in (((1e8, 0), (0, 0)), ((0, 1e-6), (1e9, 0))):
        with rejected("force is too large for the mass of the body"):
            light.apply_force(force, point)
    with rejected("torque is too large for the mass of the body"):
        light.apply_torque(1e8)


def test_joints_must_connect_two_bodies_of_a_world(world: PhysicsWorld, body: PhysicsBody) -> None:
    for create in (world.create_revolute_joint, world.create_weld_joint):
        with rejected("a joint must connect two different bodies"):
            create(body, body, (0, 0), (1, 0))
    stranger = PhysicsWorld().create_body("dynamic", (0, 0, 0))
    with rejected("a joint must connect bodies of its own world"):
        world.create_weld_joint(body, stranger, (0, 0), (0, 0))


def test_joint_limits_must_be_in_order(world: PhysicsWorld, body: PhysicsBody) -> None:
    other = world.create_body("dynamic", (0, 0, 0))
    with rejected("the lower limit must not be greater than the upper limit, got (1, -1)"):
        world.create_revolute_joint(body, other, (0, 0), (0, 0), limits=(1.0, -1.0))
    joint = world.create_revolute_joint(body, other, (0, 0), (0, 0))
    with rejected("the lower limit must not be greater than the upper limit, got (2, 1.5)"):
        joint.set_limits(2, 1.5)
    weld = world.create_weld_joint(body, other, (0, 0), (0, 0))
    with pytest.raises(PhysicsError, match="only revolute joints have limits"):
        weld.set_limits(0, 1)


def test_edges_of_zero_length_are_skipped(world: PhysicsWorld) -> None:
    wall = world.create_body("static", (0, 0, 0))
    edges = [[1, 1, 1, 1], [0, 0, 0, 1], [5, 5, 5, 5 + 1e-8]]
    assert wall.create_edges(edges) == 1
    assert wall.edges().tolist() == [[0, 0, 0, 1]]
    assert wall.create_edges(np.zeros((0, 4))) == 0
