"""Bodies and fixtures of the physics world."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from flatland.physics import PhysicsBody, PhysicsWorld

STEP = 0.01


def run(world: PhysicsWorld, steps: int) -> None:
    for _ in range(steps):
        world.step(STEP, 10, 10)


def disc(world: PhysicsWorld, x: float = 0.0, y: float = 0.0, **options: float) -> PhysicsBody:
    body = world.create_body("dynamic", (x, y, 0), **options)
    body.create_circle((0, 0), 0.5, density=1.0)
    return body


def test_a_body_has_the_pose_of_its_creation(world: PhysicsWorld) -> None:
    body = world.create_body("kinematic", (1, 2, 3), linear_damping=0.25, angular_damping=0.5)
    assert body.pose == pytest.approx((1, 2, 3))
    assert body.type == "kinematic"
    assert (body.linear_damping, body.angular_damping) == (0.25, 0.5)
    assert body.velocity == (0, 0, 0)
    assert body.fixtures == []
    body.set_pose(-4, 5, -6)
    assert body.pose == pytest.approx((-4, 5, -6))
    assert body.world is world


def test_mass_and_center_of_mass(world: PhysicsWorld) -> None:
    body = world.create_body("dynamic", (1, 0, math.pi / 2))
    body.create_polygon([(0, 0), (2, 0), (2, 1), (0, 1)], density=3)
    assert body.mass == pytest.approx(6)
    assert body.local_center == pytest.approx((1, 0.5))
    assert body.world_center == pytest.approx((0.5, 1), abs=1e-6)
    assert body.inertia == pytest.approx(6 / 3 * (2**2 + 1**2), rel=1e-5)
    assert world.create_body("static", (0, 0, 0)).mass == 0
    assert world.create_body("kinematic", (0, 0, 0)).mass == 0


def test_a_dynamic_body_without_density_has_a_mass_of_one_kilogram(world: PhysicsWorld) -> None:
    """The rule of Box2D up to 2.3 and of the reference; in 2.4 such a body cannot be moved."""
    body = world.create_body("dynamic", (1, 0, math.pi / 2))
    assert (body.mass, body.inertia, body.local_center) == (1, 0, (0, 0))
    body.create_circle((0.5, 0.5), 0.3, density=0)
    assert (body.mass, body.inertia, body.local_center) == (1, 0, (0, 0))
    body.apply_force((3, 0), (1, 0.4))
    body.apply_torque(2)
    world.step(STEP, 10, 10)
    assert body.velocity == pytest.approx((3 * STEP, 0, 0), rel=1e-5)
    body.create_polygon([(0, 0), (2, 0), (2, 1), (0, 1)], density=3)
    assert body.mass == pytest.approx(6)
    assert body.local_center == pytest.approx((1, 0.5))
    body.create_circle((0, 0), 0.3, density=0)
    assert body.mass == pytest.approx(6)


def test_a_large_map_stops_bodies_created_before_and_after_it(world: PhysicsWorld) -> None:
    """The edges of large maps are excluded from the search for new pairs in Box2D."""
    before, resting = disc(world, -2, 0), disc(world, -0.4, 5)
    world.step(STEP, 10, 10)
    resting.awake = False
    wall = world.create_body("static", (0, 0, 0))
    y = np.linspace(-10, 10, 10_001)
    x = np.zeros(10_000)
    assert wall.create_edges(np.stack([x, y[:-1], x, y[1:]], 1)) == 10_000
    after = disc(world, 2, 0)
    for body in (before, after):
        body.set_velocity(-2 * np.sign(body.pose[0]), 0, 0)
    run(world, 200)
    assert before.pose[0] == pytest.approx(-0.5, abs=0.06)
    assert after.pose[0] == pytest.approx(0.5, abs=0.06)
    assert resting.pose[0] < -0.48, "pushed out of the wall that came upon it"


@pytest.mark.parametrize("body_type", ["dynamic", "kinematic"])
def test_velocity_is_that_of_the_origin(world: PhysicsWorld, body_type: str) -> None:
    """The origin has the velocity even if the center of mass is elsewhere."""
    body = world.create_body(body_type, (0, 0, 0.3))
    body.create_circle((2, 0), 0.5, density=1)
    body.set_velocity(0.5, -0.25, 2.0)
    assert body.velocity == pytest.approx((0.5, -0.25, 2.0))
    # In one short step, the effect of the centripetal acceleration is of second order.
    world.step(1e-4, 10, 10)
    x, y, theta = body.pose
    assert (x, y) == pytest.approx((0.5e-4, -0.25e-4), abs=1e-6)
    assert theta == pytest.approx(0.3 + 2e-4)


def test_static_bodies_ignore_velocities(world: PhysicsWorld) -> None:
    body = world.create_body("static", (0, 0, 0))
    body.set_velocity(1, 1, 1)
    run(world, 10)
    assert body.pose == (0, 0, 0)
    assert body.velocity == (0, 0, 0)


def test_force_and_torque_act_for_one_step(world: PhysicsWorld) -> None:
    body = disc(world)
    body.apply_force((3, 0), (0, -0.5))
    body.apply_torque(2)
    for _ in range(2):
        run(world, 1)
        expected = (3 / body.mass * STEP, 0, (3 * 0.5 + 2) / body.inertia * STEP)
        assert body.velocity == pytest.approx(expected, rel=1e-5)


def test_damping_reduces_the_velocity(world: PhysicsWorld) -> None:
    body = disc(world, linear_damping=2.0, angular_damping=3.0)
    body.set_velocity(1, 0, 1)
    run(world, 1)
    assert body.velocity == pytest.approx((1 / (1 + 2 * STEP), 0, 1 / (1 + 3 * STEP)))


def test_bodies_fall_asleep_and_wake_up(world: PhysicsWorld) -> None:
    body = disc(world)
    run(world, 100)
    assert not body.awake
    body.set_pose(1, 0, 0)
    assert body.awake
    run(world, 100)
    assert not body.awake
    body.apply_force((1, 0), (1, 0))
    assert body.awake
    body.awake = False
    body.apply_torque(1)
    assert body.awake
    body.set_velocity(1, 0, 0)
    body.awake = False
    assert body.velocity == (0, 0, 0)
    body.awake = True
    assert body.awake


def test_a_moved_body_is_separated_from_bodies_at_its_new_pose(world: PhysicsWorld) -> None:
    """Box2D alone would leave both bodies asleep and overlapping."""
    mover, sleeper = disc(world), disc(world, 10)
    run(world, 100)
    assert not sleeper.awake
    mover.set_pose(10.4, 0, 0)
    run(world, 200)
    assert np.hypot(*(np.array(mover.pose) - sleeper.pose)[:2]) == pytest.approx(1, abs=0.02)


def test_a_moved_static_body_wakes_the_bodies_at_each_of_its_fixtures(world: PhysicsWorld) -> None:
    sleepers = [disc(world, x) for x in (10, 14)]
    pillars = world.create_body("static", (-20, 0, 0))
    for x in (0, 4):
        pillars.create_circle((x, 0), 0.4, density=0)
    run(world, 100)
    pillars.set_pose(10, 0, 0)
    assert [body.awake for body in sleepers] == [True, True]


def test_destroying_a_static_body_wakes_the_bodies_in_contact_with_it(world: PhysicsWorld) -> None:
    leaning = disc(world, 1.49)
    wall = world.create_body("static", (0, 0, 0))
    wall.create_polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)], density=0)
    run(world, 300)
    assert not leaning.awake
    wall.set_pose(-20, 0, 0)
    assert leaning.awake


def test_new_fixtures_wake_the_bodies_that_they_overlap(world: PhysicsWorld) -> None:
    sleeper = disc(world)
    run(world, 100)
    world.create_body("static", (0, 0, 0)).create_edges([[0.4, -1, 0.4, 1]])
    run(world, 200)
    assert sleeper.pose[0] < -0.05


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("turned", [False, True])
def test_edges_stop_bodies_from_both_sides(world: PhysicsWorld, side: int, turned: bool) -> None:
    edge = [0, 5, 0, -5] if turned else [0, -5, 0, 5]
    world.create_body("static", (0, 0, 0)).create_edges([edge])
    body = disc(world, 2.0 * side)
    body.set_velocity(-3 * side, 0, 0)
    run(world, 300)
    assert body.pose[0] * side == pytest.approx(0.5, abs=0.02)


def test_fast_bodies_do_not_pass_through_walls(world: PhysicsWorld) -> None:
    world.create_body("static", (0, 0, 0)).create_edges([[0, -5, 0, 5]])
    body = disc(world, -2)
    body.set_velocity(150, 0, 0)
    run(world, 50)
    assert body.pose[0] < 0


def test_properties_of_fixtures(world: PhysicsWorld) -> None:
    body = world.create_body("dynamic", (0, 0, 0))
    circle = body.create_circle(
        (1, 2),
        0.5,
        density=2,
        friction=0.25,
        restitution=0.75,
        is_sensor=True,
        category_bits=6,
        mask_bits=9,
    )
    polygon = body.create_polygon([(0, 0), (3, 0), (0, 3)], density=1)
    body.create_edges([[0, 0, 2, 4]], friction=0.5)
    edge = body.fixtures[2]
    assert body.fixtures == [circle, polygon, edge]
    assert [fixture.shape for fixture in body.fixtures] == ["circle", "polygon", "edge"]
    assert (circle.center, circle.radius, circle.vertices.shape) == ((1, 2), 0.5, (0, 2))
    assert (circle.density, circle.friction, circle.restitution) == (2, 0.25, 0.75)
    assert circle.is_sensor
    assert (circle.category_bits, circle.mask_bits) == (6, 9)
    assert polygon.center == pytest.approx((1, 1))
    assert polygon.radius == 0
    a, b, c = polygon.vertices
    assert np.linalg.det([b - a, c - a]) > 0, "corners come counter-clockwise"
    assert edge.vertices.tolist() == [[0, 0], [2, 4]]
    assert (edge.center, edge.density, edge.friction) == ((1, 2), 0, 0.5)
    assert edge.body == body
    assert (polygon.category_bits, polygon.mask_bits) == (0xFFFF, 0xFFFF)


def test_edges_are_returned_unchanged(world: PhysicsWorld) -> None:
    body = world.create_body("static", (5, 5, 1))
    edges = np.random.default_rng(1).uniform(-10, 10, (50, 4)).astype(np.float32)
    body.create_circle((0, 0), 1, density=0)
    assert body.create_edges(edges[:30]) == 30
    assert body.create_edges(edges[30:]) == 20
    assert body.edges().dtype == np.float32
    np.testing.assert_array_equal(body.edges(), edges)


@pytest.mark.parametrize("bits", [(1, 2), (2, 1), (0, 0xFFFF), (0xFFFF, 0)])
def test_filters_prevent_collisions(world: PhysicsWorld, bits: tuple[int, int]) -> None:
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[0, -5, 0, 5]], category_bits=1, mask_bits=1)
    body = world.create_body("dynamic", (-2, 0, 0))
    body.create_circle((0, 0), 0.5, density=1, category_bits=bits[0], mask_bits=bits[1])
    body.set_velocity(3, 0, 0)
    run(world, 200)
    assert body.pose[0] > 2


def test_changed_filters_and_sensor_flags_apply_to_sleeping_bodies(world: PhysicsWorld) -> None:
    bodies = [disc(world), disc(world, 0.6)]
    circle = bodies[0].fixtures[0]
    circle.mask_bits = 0
    run(world, 100)
    assert bodies[1].pose == pytest.approx((0.6, 0, 0), abs=1e-5), "they do not collide"
    circle.is_sensor = True
    circle.mask_bits = 0xFFFF
    run(world, 100)
    assert bodies[1].pose == pytest.approx((0.6, 0, 0), abs=1e-5), "nor does a sensor"
    assert not bodies[1].awake
    circle.is_sensor = False
    run(world, 200)
    assert bodies[1].pose[0] - bodies[0].pose[0] == pytest.approx(1, abs=0.02)


def test_a_density_sets_the_mass(world: PhysicsWorld) -> None:
    body = disc(world)
    mass, inertia = body.mass, body.inertia
    body.fixtures[0].density = 3.0
    assert (body.mass, body.inertia) == pytest.approx((3 * mass, 3 * inertia))
    for density in (-1.0, math.nan, 1e30):
        with pytest.raises(ValueError, match=r"density|mass"):
            body.fixtures[0].density = density
    assert body.fixtures[0].density == 3.0
    assert body.mass == pytest.approx(3 * mass)


def test_friction_applies_to_present_contacts(world: PhysicsWorld) -> None:
    def distance(friction: float) -> float:
        """Returns how far a box that is pressed on a wall slides."""
        world = PhysicsWorld()
        wall = world.create_body("static", (0, 0, 0))
        wall.create_edges(np.array([[-50, 0, 50, 0]], np.float32), friction=1.0)
        box = world.create_body("dynamic", (0, 0.5, 0))
        box.create_polygon(
            [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], density=1.0, friction=1.0
        )
        for _ in range(100):
            box.apply_force((0, -10), box.world_center)
            world.step(STEP, 10, 10)
        box.fixtures[0].friction = friction
        box.set_velocity(1, 0, 0)
        for _ in range(20):
            box.apply_force((0, -10), box.world_center)
            world.step(STEP, 10, 10)
        return float(box.pose[0])

    assert distance(0.0) == pytest.approx(0.2, abs=1e-3)
    assert distance(1.0) < 0.1
    with pytest.raises(ValueError, match="friction"):
        disc(world).fixtures[0].friction = -1.0


def test_shapes_are_scaled_about_the_origin(world: PhysicsWorld) -> None:
    body = world.create_body("dynamic", (1, 0, 0))
    body.create_circle((0.5, 0), 0.25, density=2.0)
    body.create_polygon([(0, 0), (1, 0), (1, 1), (0, 1)], density=1.0)
    mass = body.mass
    body.scale_shapes(2.0)
    assert body.mass == pytest.approx(4 * mass)
    circle, polygon = body.fixtures
    assert (circle.center, circle.radius) == ((1, 0), 0.5)
    assert sorted(polygon.vertices.tolist()) == [[0, 0], [0, 2], [2, 0], [2, 2]]
    # Rays and discs meet the new shapes.
    hit, _ = world.cast_rays((9, 1.5, math.pi), np.array([[10, 0]], np.float32), 0xFFFF)
    assert 10 * hit[0] == pytest.approx(9 - 3, abs=0.01)
    assert not world.free_discs([(2.9, 1.9, 0)], 0.05, 0xFFFF)[0]
    for factor in (0.0, 11.0, math.nan):
        with pytest.raises(ValueError, match="factor must be from"):
            body.scale_shapes(factor)
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges(np.array([[-5, 0, 5, 0]], np.float32))
    with pytest.raises(ValueError, match="edges"):
        wall.scale_shapes(2.0)


def test_the_mass_of_scaled_shapes_is_limited(world: PhysicsWorld) -> None:
    body = world.create_body("dynamic", (0, 0, 0))
    body.create_circle((0, 0), 30.0, density=1e9 / math.pi)
    assert body.inertia == pytest.approx(4.05e14)  # kg m²
    with pytest.raises(ValueError, match=r"mass of the body is too large for a factor of 1\.26"):
        body.scale_shapes(1.26)  # to 1.02e15 kg m²
    assert body.fixtures[0].radius == 30.0
    body.scale_shapes(1.2)
    assert body.fixtures[0].radius == pytest.approx(36.0)


def massless(world: PhysicsWorld, radius: float = 0.2) -> PhysicsBody:
    body = world.create_body("dynamic", (0, 0, 0))
    body.create_circle((0.3, 0), radius, density=0.0)
    return body


@pytest.mark.parametrize(
    "change",
    [
        lambda body: body.scale_shapes(1.5),
        lambda body: body.scale_shapes(0.5),
        lambda body: setattr(body.fixtures[0], "density", 0.0),
        lambda body: (
            setattr(body.fixtures[0], "density", 5.0),
            setattr(body.fixtures[0], "density", 0.0),
        ),
        lambda body: body.create_polygon([(0, 0), (1, 0), (0, 1)], density=0.0),
        lambda body: body.create_circle((0, 0), 0.0, density=1.0),
        lambda body: setattr(body.fixtures[0], "is_sensor", True),
    ],
)
def test_a_body_without_density_keeps_its_mass_of_one_kilogram(
    world: PhysicsWorld, change: Callable[[PhysicsBody], object]
) -> None:
    body = massless(world)
    saved = world.copy()
    change(body)
    for each in (body, world.copy().body(body.id)):
        assert (each.mass, each.inertia) == (1.0, 0.0)
        assert each.local_center == (0.0, 0.0)
    world.become_copy_of(saved)
    assert body.mass == 1.0
    change(body)
    body.apply_force((1.0, 0.0), (0.0, 0.0))
    world.step(STEP, 10, 10)
    assert body.velocity == pytest.approx((STEP, 0.0, 0.0))


def test_a_body_with_density_has_the_mass_of_its_shapes_after_each_change(
    world: PhysicsWorld,
) -> None:
    body = massless(world)
    body.fixtures[0].density = 2.0
    assert body.mass == pytest.approx(2.0 * math.pi * 0.2**2)
    assert body.local_center == pytest.approx((0.3, 0.0))
    body.scale_shapes(2.0)
    assert body.mass == pytest.approx(2.0 * math.pi * 0.4**2)
    body.fixtures[0].density = 0.0
    assert (body.mass, body.inertia, body.local_center) == (1.0, 0.0, (0.0, 0.0))


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_shapes_that_are_scaled_again_and_again_stay_in_the_range_of_the_engine(
    world: PhysicsWorld, factor: float
) -> None:
    def add(body: PhysicsBody) -> None:
        body.create_polygon([(0.1, 0), (0.3, 0), (0.2, 0.2)], density=1.0)
        body.create_circle((0.0, 0.1), 0.2, density=1.0)

    for kind in ("dynamic", "kinematic", "static"):
        body = world.create_body(kind, (0, 0, 0))
        add(body)
        for _ in range(40):
            before = [shape.vertices.tolist() for shape in body.fixtures], body.mass
            try:
                body.scale_shapes(factor)
            except ValueError:
                break
        assert ([shape.vertices.tolist() for shape in body.fixtures], body.mass) == before
        world.step(STEP, 10, 10)
        assert all(math.isfinite(number) for number in body.pose)
        with pytest.raises(ValueError, match=r"mass|area|corner|center|radius"):
            body.scale_shapes(factor)
        body.destroy()


def test_motions_of_several_bodies_are_read_in_one_call(world: PhysicsWorld) -> None:
    bodies = [world.create_body("dynamic", (1.5 * i, -i, 0.25 * i)) for i in range(3)]
    for i, body in enumerate(bodies):
        body.create_circle((0.0, 0.0), 0.1, density=1.0)
        body.set_velocity(1.0 + i, 2.0 * i, -0.5 * i)
    # A new array may contain anything.
    for chosen in (bodies, bodies[::-1], bodies[2:]):
        expected = [[*body.pose, *body.velocity] for body in chosen]
        assert world.motions(chosen).tolist() == expected
