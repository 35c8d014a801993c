"""Single rays and scans, compared with analytic results."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from flatland.physics import PhysicsWorld

ALL = 0xFFFF


def fan(count: int, length: float, start: float = -math.pi, stop: float = math.pi) -> npt.NDArray:
    angles = np.linspace(start, stop, count)
    return (length * np.stack([np.cos(angles), np.sin(angles)], 1)).astype(np.float32)


def add_room(world: PhysicsWorld, half: float = 5.0, **options: int) -> None:
    h = half
    edges = [[-h, -h, h, -h], [h, -h, h, h], [h, h, -h, h], [-h, h, -h, -h]]
    world.create_body("static", (0, 0, 0)).create_edges(edges, **options)


def test_a_single_ray(world: PhysicsWorld) -> None:
    add_room(world, category_bits=4)
    hit = world.ray_cast((0, 1), (10, 1))
    assert hit is not None
    assert hit.fraction == pytest.approx(0.5)
    assert hit.point == pytest.approx((5, 1))
    assert hit.normal == pytest.approx((-1, 0))
    assert hit.category_bits == 4
    assert hit.fixture.shape == "edge"
    assert world.ray_cast((0, 1), (4.9, 1)) is None
    assert world.ray_cast((0, 1), (10, 1), mask=0xFFFB) is None
    assert world.ray_cast((1, 1), (1, 1)) is None, "no length"


def test_a_scan_in_a_room(world: PhysicsWorld) -> None:
    add_room(world)
    x, y, theta = 1.0, -2.0, 0.7
    ends = fan(720, 20)
    fractions, reflect = world.cast_rays((x, y, theta), ends, ALL)
    angles = np.linspace(-math.pi, math.pi, 720) + theta
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angles) > 0, 5 - x, -5 - x) / np.cos(angles)
        to_y = np.where(np.sin(angles) > 0, 5 - y, -5 - y) / np.sin(angles)
    np.testing.assert_allclose(fractions * 20, np.minimum(to_x, to_y), atol=1e-4)
    assert fractions.dtype == np.float32
    assert (reflect.dtype, reflect.any()) == (np.bool_, False)


def test_misses_and_rays_of_zero_length_are_nan(world: PhysicsWorld) -> None:
    add_room(world)
    ends = [[4.9, 0], [5, 0], [0, 0], [5.1, 0], [1e-30, 0]]
    fractions, _ = world.cast_rays((0, 0, 0), ends, ALL)
    np.testing.assert_allclose(fractions, [np.nan, 1, np.nan, 5 / 5.1, np.nan], rtol=1e-6)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 1081])
def test_any_number_of_rays(world: PhysicsWorld, count: int) -> None:
    add_room(world)
    world.create_body("dynamic", (2, 0, 0)).create_circle((0, 0), 0.5, density=1)
    ends = fan(count, 20)
    fractions, reflect = world.cast_rays((0, 0, 0.1), ends, ALL, 1)
    assert fractions.shape == reflect.shape == (count,)
    np.testing.assert_array_equal(fractions, world.cast_rays_reference((0, 0, 0.1), ends, ALL)[0])


def test_the_order_of_rays_does_not_matter(world: PhysicsWorld) -> None:
    """Rays may be clockwise, rotated, shuffled or over more than a turn."""
    add_room(world)
    world.create_body("dynamic", (2, 1, 0.3)).create_polygon([(0, 0), (1, 0), (0, 1)], density=1)
    ends = fan(500, 20, -7, 7)
    straight, _ = world.cast_rays((0, 0, 1), ends, ALL)
    assert not np.isnan(straight).any()
    order = np.random.default_rng(1).permutation(500)
    for permutation in (slice(None, None, -1), order):
        other, _ = world.cast_rays((0, 0, 1), ends[permutation], ALL)
        np.testing.assert_array_equal(other, straight[permutation])


def test_end_points_of_other_types_are_converted(world: PhysicsWorld) -> None:
    add_room(world)
    ends = fan(20, 20)
    expected, _ = world.cast_rays((0, 0, 0), ends, ALL)
    for same in (ends.astype(np.float64), ends.tolist(), np.asfortranarray(ends), ends[::-1][::-1]):
        np.testing.assert_array_equal(world.cast_rays((0, 0, 0), same, ALL)[0], expected)


def test_sensors_stop_no_rays(world: PhysicsWorld) -> None:
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[1, -1, 1, 1], [2, -1, 2, 1]])
    ball = world.create_body("dynamic", (3, 0, 0)).create_circle((0, 0), 0.5, density=1)
    wall.fixtures[0].is_sensor = True
    assert world.cast_rays((0, 0, 0), [[10, 0]], ALL)[0][0] == pytest.approx(0.2)
    wall.fixtures[1].is_sensor = True
    assert world.cast_rays((0, 0, 0), [[10, 0]], ALL)[0][0] == pytest.approx(0.25)
    ball.is_sensor = True
    assert np.isnan(world.cast_rays((0, 0, 0), [[10, 0]], ALL)[0][0])
    wall.fixtures[0].is_sensor = False
    assert world.cast_rays((0, 0, 0), [[10, 0]], ALL)[0][0] == pytest.approx(0.1)
    wall.fixtures[0].category_bits = 2
    assert np.isnan(world.cast_rays((0, 0, 0), [[10, 0]], 1)[0][0])


def test_rays_hit_the_end_points_of_edges(world: PhysicsWorld) -> None:
    """This holds for edges of both directions, from both sides."""
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[1, -1, 1, 1], [-1, -1, -1, 1]])
    ends = [[2, 2], [2, -2], [-2, 2], [-2, -2]]
    assert world.cast_rays((0, 0, 0), ends, ALL)[0].tolist() == [0.5] * 4
    ends = np.nextafter(np.float32(ends), np.float32([[0, 9]]))
    got = world.cast_rays((0, 0, 0), ends, ALL)[0]
    assert np.isnan(got).tolist() == [True, False, True, False], "and nothing beyond them"


@pytest.mark.parametrize("edge", [[-5, 0, 5, 0], [0, 3, 0, -3], [-2, -2, 2, 2], [0, 0, 2, 1]])
def test_a_scan_from_an_edge_hits_only_the_edge(world: PhysicsWorld, edge: list[float]) -> None:
    add_room(world)
    world.create_body("static", (0, 0, 0)).create_edges([edge])
    ends = fan(1000, 20)
    x, y = np.subtract(edge[2:], edge[:2])
    along = np.abs(ends @ [y, -x]) < 1e-4
    fractions, _ = world.cast_rays((0, 0, 0), ends, ALL)
    assert along.sum() <= 2
    assert (fractions[~along] == 0).all()


def test_scans_hit_bodies_that_steps_have_moved(world: PhysicsWorld) -> None:
    ball = world.create_body("dynamic", (9, 0, 0))
    ball.create_circle((0, 0), 0.5, density=1)
    ball.set_velocity(-2, 0, 0)
    door = world.create_body("kinematic", (0, 20, 0))
    door.create_edges([[-1, 0, 1, 0]])
    door.set_velocity(0, -3, 0)
    for expected in ([8.5, 20], [6.5, 17]):
        fractions, _ = world.cast_rays((0, 0, 0), [[20, 0], [0, 20]], ALL)
        assert 20 * fractions == pytest.approx(expected, abs=1e-4)
        for _ in range(100):
            world.step(0.01, 5, 5)


def test_any_of_several_fixtures_at_the_same_distance_reflects(world: PhysicsWorld) -> None:
    """Two layers contain the same wall, divided at different points."""
    plain = world.create_body("static", (0, 0, 0))
    plain.create_edges([[3, -5, 4, 5]], category_bits=1)
    mirror = world.create_body("static", (0.5, 0.5, 0.5))
    line = np.array([[3, -5], [4, 5]]) - 0.5
    cut = line[0] + np.outer([0.4, 0.6], line[1] - line[0])
    turn = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])
    mirror.create_edges([(cut @ turn).ravel()], category_bits=2)
    ends = fan(181, 20, -1, 1)
    fractions, reflect = world.cast_rays((0, 0, 0), ends, 3, 2)
    hits = fractions[:, None] * ends
    np.testing.assert_array_equal(reflect, np.abs(hits[:, 1]) < 1)
    np.testing.assert_array_equal(reflect, world.cast_rays_reference((0, 0, 0), ends, 3, 2)[1])


def test_a_hit_near_the_end_of_a_ray_does_not_reflect(world: PhysicsWorld) -> None:
    """Rays that end less than 0.1 mm behind a surface, beside edges that reflect."""
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[5, -1, 5, 1], [0, -1e-5, 0.5, -1e-5]], category_bits=1)
    wall.create_edges([[2, 3, 3, 3], [5.00005, -1, 5.00005, 1]], category_bits=2)
    ends = [[5.00002, 0], [5.00001, 0.5], [0, -3e-5], [5.0002, 0]]
    fractions, reflect = world.cast_rays((0, 0, 0), ends, 3, 2)
    np.testing.assert_allclose(fractions, [1, 1, 1 / 3, 1], rtol=1e-4)
    assert reflect.tolist() == [False, False, False, True]
    reference = world.cast_rays_reference((0, 0, 0), ends, 3, 2)
    np.testing.assert_array_equal(fractions, reference[0])
    np.testing.assert_array_equal(reflect, reference[1])


@pytest.mark.parametrize("angle", np.arange(0.1, 6.3, 0.3))
def test_a_ray_along_the_line_of_a_wall_has_no_hit_beside_the_wall(
    world: PhysicsWorld, angle: float
) -> None:
    """The origin of the ray is on the line within the rounding errors, as are the ends."""
    rng = np.random.default_rng(int(angle * 1000))
    along = np.array([math.cos(angle), math.sin(angle)])
    edges = [np.hstack([a * along, b * along]) for a, b in rng.uniform(1, 100, (8, 2))]
    near = min(min(np.hypot(*edge[:2]), np.hypot(*edge[2:])) for edge in edges)
    world.create_body("static", (0, 0, 0)).create_edges(edges)
    turns = angle + np.concatenate([rng.normal(0, 1e-7, 200), math.pi + rng.normal(0, 1e-7, 200)])
    ends = 200 * np.stack([np.cos(turns), np.sin(turns)], 1)
    fractions, _ = world.cast_rays((0, 0, 0), ends, ALL)
    ahead, behind = fractions[:200], fractions[200:]
    assert np.isnan(behind).all()
    # A ray along a wall may miss it.
    assert np.all(np.isnan(ahead) | (ahead * 200 >= near * (1 - 1e-5)))


def test_one_of_several_layers_is_moved_changed_and_destroyed(world: PhysicsWorld) -> None:
    def distance(mask: int = ALL) -> float:
        return float(world.cast_rays((0, 0, 0), [[10, 0]], mask)[0][0] * 10)

    assert math.isnan(distance())
    bodies = [world.create_body("static", (0, 0, 0)) for _ in range(3)]
    for body in bodies:
        body.create_edges([[1, -1, 1, 1]])
    assert distance() == pytest.approx(1)
    bodies[1].set_pose(-0.5, 0, 0)
    assert distance() == pytest.approx(0.5)
    bodies[1].set_pose(0, 0, 0)
    assert distance() == pytest.approx(1)
    bodies[0].create_edges([[0.25, -1, 0.25, 1]])
    assert distance() == pytest.approx(0.25)
    bodies[0].destroy()
    assert distance() == pytest.approx(1)
    bodies[2].fixtures[0].category_bits = 8
    assert distance(mask=8) == pytest.approx(1)
    bodies[1].destroy()
    assert math.isnan(distance(mask=1))
    bodies[2].destroy()
    assert math.isnan(distance())


def test_scans_are_correct_with_more_fans_than_are_cached(world: PhysicsWorld) -> None:
    """Casts the rays of many different fans in turns."""
    add_room(world)
    fans = [fan(30 + i, 20) for i in range(40)]
    for _ in range(2):
        for ends in fans:
            np.testing.assert_array_equal(
                world.cast_rays((1, 1, 1), ends, ALL)[0],
                world.cast_rays_reference((1, 1, 1), ends, ALL)[0],
            )


def test_changed_end_points_are_used(world: PhysicsWorld) -> None:
    add_room(world)
    ends = fan(8, 20)
    world.cast_rays((0, 0, 0), ends, ALL)
    ends *= np.float32(0.5)
    fractions, _ = world.cast_rays((0, 0, 0), ends, ALL)
    np.testing.assert_array_equal(fractions, world.cast_rays_reference((0, 0, 0), ends, ALL)[0])
