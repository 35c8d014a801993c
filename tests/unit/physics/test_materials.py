"""Materials in the core: glass, mirrors and intensities, and what beams hit."""

from __future__ import annotations

import hashlib
import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from flatland.physics import (
    Material,
    PhysicsBody,
    PhysicsWorld,
    RangeFinder,
    RangeNoise,
    ScanRequest,
    scan_all,
)

LENGTH = 20.0
WALL = 1 << 60  # id of the first body
GLASS = Material(transmission=0.7)
MIRROR = Material(specular=1.0)
FRONT = np.linspace(-0.5, 0.5, 1001)


def finder(angles: npt.ArrayLike, **options: Any) -> RangeFinder:
    ends = LENGTH * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return RangeFinder(ends, LENGTH, **{"origin": (0, 0, 0), "mask": 0xFFFF, **options})


def room(size: float = 8.0) -> tuple[PhysicsWorld, PhysicsBody]:
    """Creates a square room around the origin, and a body without fixtures for the sensor."""
    world = PhysicsWorld()
    wall = world.create_body("static", (0, 0, 0))
    corners = size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    wall.create_edges(np.hstack([corners, np.roll(corners, -1, axis=0)]), category_bits=1)
    return world, world.create_body("static", (0, 0, 0))


def add_edge(
    world: PhysicsWorld, edge: list[float], material: Material | None, bits: int = 1
) -> PhysicsBody:
    body = world.create_body("static", (0, 0, 0))
    body.create_edges([edge], category_bits=bits)
    if material is not None:
        body.set_material(material)
    return body


def add_box(
    world: PhysicsWorld, pose: tuple[float, float, float], material: Material | None
) -> PhysicsBody:
    body = world.create_body("kinematic", pose)
    corners = [(-0.5, -0.2), (0.5, -0.2), (0.5, 0.2), (-0.5, 0.2)]
    fixture = body.create_polygon(corners, density=0)
    if material is not None:
        fixture.material = material
    return body


def clutter(seed: int, material: Any) -> tuple[PhysicsWorld, PhysicsBody]:
    """Creates a room with edges, circles and boxes of materials drawn by a function."""
    rng = np.random.default_rng(seed)
    world, sensor = room()
    for index in range(60):
        x, y, turn = rng.uniform(-7, 7, 3)
        if index % 3 == 0:
            edge = [x, y, *(np.array([x, y]) + rng.normal(0, 1, 2))]
            add_edge(world, edge, material(rng), bits=1 << (index % 4))
        elif index % 3 == 1:
            add_box(world, (x, y, turn), material(rng))
        else:
            body = world.create_body("dynamic", (x, y, turn))
            fixture = body.create_circle((0.1, 0), 0.3, density=1)
            drawn = material(rng)
            if drawn is not None:
                fixture.material = drawn
    return world, sensor


def any_material(rng: np.random.Generator) -> Material | None:
    if rng.random() < 0.3:
        return None
    share = rng.uniform(0, 1, 3) * (rng.random(3) < 0.7)
    return Material(share[0], share[1], min(share[2], 1 - share[1]))


# -- glass ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", ["edge", "box", "circle"])
def test_a_share_of_the_beams_passes_glass(shape: str) -> None:
    world, sensor = room()
    exact = finder(FRONT).scan(sensor, 1, 1).ranges
    if shape == "edge":
        add_edge(world, [3, -8, 3, 8], GLASS)
    elif shape == "box":
        body = world.create_body("static", (3.5, 0, 0))
        corners = [(-0.5, -6), (0.5, -6), (0.5, 6), (-0.5, 6)]
        body.create_polygon(corners, density=0).material = GLASS
    else:
        body = world.create_body("static", (13, 0, 0))
        body.create_circle((0, 0), 10, density=0).material = GLASS
    passed = 0
    updates = 40
    for update in range(updates):
        ranges = finder(FRONT).scan(sensor, 1, update).ranges
        is_far = ranges == exact
        assert (is_far | (ranges < exact - 1)).all()
        passed += int(is_far.sum())
    count = updates * len(FRONT)
    # Five standard deviations of a binomial distribution.
    assert abs(passed - 0.7 * count) < 5 * math.sqrt(0.7 * 0.3 * count)


def test_two_panes_are_independent() -> None:
    world, sensor = room()
    add_edge(world, [3, -8, 3, 8], GLASS)
    add_edge(world, [5, -8, 5, 8], GLASS)
    hits = np.zeros(3)
    for update in range(40):
        x = finder(FRONT).scan(sensor, 1, update).ranges * np.cos(FRONT)
        hits += [(np.abs(x - wall) < 1e-3).sum() for wall in (3, 5, 8)]
    count = hits.sum()
    assert count == 40 * len(FRONT)
    expected = count * np.array([0.3, 0.7 * 0.3, 0.7**2])
    assert (np.abs(hits - expected) < 5 * np.sqrt(expected * (1 - expected / count))).all()


def test_beams_are_independent_of_each_other_and_of_the_update() -> None:
    world, sensor = room()
    add_edge(world, [3, -8, 3, 8], Material(transmission=0.5))
    passes = np.array(
        [finder(FRONT).scan(sensor, 1, update).ranges > 6 for update in range(200)], float
    )
    passes -= passes.mean()
    for correlation in (
        (passes[:, 1:] * passes[:, :-1]).mean(),
        (passes[1:] * passes[:-1]).mean(),
        (passes[:, 16:] * passes[:, :-16]).mean(),
    ):
        assert abs(correlation) < 5 * 0.25 / math.sqrt(passes.size)


def test_perfectly_clear_glass_is_invisible_and_opaque_material_changes_no_range() -> None:
    world, sensor = room()
    exact = finder(FRONT).scan(sensor, 1, 1).ranges
    pane = add_edge(world, [3, -8, 3, 8], Material(transmission=1.0))
    assert (finder(FRONT).scan(sensor, 1, 1).ranges == exact).all()
    blocked = finder(FRONT, uses_materials=False).scan(sensor, 1, 1)
    assert blocked.intensities is None
    pane.set_material(Material(reflectance=0.9))
    assert (finder(FRONT).scan(sensor, 1, 1).ranges == blocked.ranges).all()


# -- mirrors ----------------------------------------------------------------------------------


def test_a_mirror_shows_objects_at_the_distance_of_their_image() -> None:
    world, sensor = room()
    add_edge(world, [3, -8, 3, 8], MIRROR)
    target = world.create_body("static", (1.0, 2.0, 0))
    target.create_circle((0, 0), 0.25, density=0)
    # The image of the target is at (5, 2).
    angle = math.atan2(2.0, 5.0)
    scan = finder([angle]).scan_labels(sensor, 1, 1)
    assert scan.ranges == pytest.approx([math.hypot(2.0, 5.0) - 0.25], abs=1e-5)
    assert scan.hits[scan.labels[0] - 1][0] == target.id


@pytest.mark.parametrize("turn", [0.0, math.pi / 2])
def test_a_mirror_shows_the_end_of_a_group_of_edges_that_begins_far_behind_it(turn: float) -> None:
    world = PhysicsWorld()
    sensor = world.create_body("static", (0, 0, turn))
    world.create_body("static", (0, 0, turn)).create_edges(
        [[2, -0.5, 2, 0.5], [-18, 5, -18, 6]], category_bits=1
    )
    mirror = world.create_body("static", (0, 0, turn))
    mirror.create_edges([[-1, -1, -1, 1]], category_bits=1)
    mirror.set_material(MIRROR)
    assert finder([math.pi]).scan(sensor, 1, 1).ranges == pytest.approx([1 + 3])


def test_a_beam_is_reflected_only_once() -> None:
    world, sensor = room()
    add_edge(world, [3, -8, 3, 8], MIRROR)
    add_edge(world, [-2, -8, -2, 8], MIRROR)
    scan = finder([0.0] + [0.001] * 5).scan(sensor, 1, 1)
    assert scan.ranges == pytest.approx([3 + 5] * 6, abs=1e-3)


def test_a_reflected_beam_ends_at_the_range_of_the_sensor() -> None:
    world, sensor = room(size=14.0)
    add_edge(world, [7, -14, 7, 14], MIRROR)
    assert math.isnan(finder([0.0, 0.01]).scan(sensor, 1, 1).ranges[0])  # 7 + 21 m > 20 m


@pytest.mark.parametrize("turn", [0.0, 1.6, 3.1])
def test_few_and_many_reflected_beams_have_the_same_ranges(turn: float) -> None:
    world, sensor = room()
    for x, y in itertools.product((-6, -4, 4, 6), repeat=2):
        add_box(world, (x, y, x + y / 2), None)
    ends = np.array([[2.0, 2.0], [-2.0, 2.5]]) @ np.array(
        [[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]
    )
    pane = add_edge(world, list(ends.ravel()), MIRROR)
    scan = finder(np.linspace(-math.pi, math.pi, 1081)[:-1]).scan
    many = scan(sensor, 1, 0).ranges
    pane.set_material(Material(specular=0.0))
    direct = scan(sensor, 1, 0).ranges
    pane.set_material(Material(specular=0.1))
    few = scan(sensor, 1, 0).ranges
    is_mirror = many != direct
    is_reflected = few != direct
    assert is_mirror.sum() > 150
    assert 5 < is_reflected.sum() < 0.25 * is_mirror.sum()
    assert (few[is_reflected] == many[is_reflected]).all()


def test_no_beam_leaves_a_room_with_mirrors_at_its_corners(world: PhysicsWorld) -> None:
    sensor = world.create_body("static", (0.3, -0.2, 0))
    corners = 4.0 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for index in range(4):
        edge = [*corners[index], *corners[(index + 1) % 4]]
        add_edge(world, edge, MIRROR if index % 2 else None)
    toward = [
        math.atan2(y + 0.2, x - 0.3) + offset
        for x, y in corners
        for offset in np.linspace(-1e-4, 1e-4, 401)
    ]
    ranges = finder(toward).scan(sensor, 1, 1).ranges
    assert np.isfinite(ranges).all()
    assert ranges.max() < 2 * math.hypot(8, 8)


@pytest.mark.parametrize("seed", range(6))
def test_reflections_equal_those_of_single_rays(seed: int) -> None:
    """Compares with two rays of `ray_cast`, the second one along the mirrored direction."""

    def draw(rng: np.random.Generator) -> Material | None:
        return MIRROR if rng.random() < 0.5 else None

    world, sensor = clutter(seed, draw)
    angles = np.linspace(-math.pi, math.pi, 721)
    scan = finder(angles).scan(sensor, 1, 1)
    assert scan.intensities is not None
    different = 0
    reflected = 0
    for angle, got, intensity in zip(angles, scan.ranges, scan.intensities, strict=True):
        direction = np.array([math.cos(angle), math.sin(angle)])
        hit = world.ray_cast((0, 0), tuple(LENGTH * direction))
        assert hit is not None
        expected = hit.fraction * LENGTH
        if hit.fixture.material is not None:
            reflected += 1
            direction = direction - 2 * direction.dot(hit.normal) * np.array(hit.normal)
            start = np.array(hit.point) + 1e-4 * direction
            hit = world.ray_cast(start, start + (LENGTH - expected) * direction)
            expected = (
                math.nan if hit is None else expected + 1e-4 + hit.fraction * (LENGTH - expected)
            )
        if hit is None:
            is_same = math.isnan(got) and intensity == 0
        else:
            scale = 255 * 0.5 / max(expected, 1) ** 2
            cosine = abs(direction.dot(hit.normal))
            is_same = abs(got - expected) < 2e-3 and abs(intensity / scale - cosine) < 0.02
        different += not is_same  # a beam that grazes an outline
    assert reflected > 100
    assert different <= 6


def test_a_mirror_hides_what_is_directly_behind_it() -> None:
    world, sensor = room()
    add_edge(world, [3, -8, 3, 8], MIRROR)
    expected = finder(FRONT).scan(sensor, 1, 1).ranges
    assert np.isfinite(expected).sum() > 500
    for x in (3.001, 3.1):
        add_edge(world, [x, -8, x, 8], None)
    add_box(world, (3.8, 1, 0.2), None)
    np.testing.assert_array_equal(finder(FRONT).scan(sensor, 1, 1).ranges, expected)


# -- intensities ------------------------------------------------------------------------------


def test_intensities_are_those_of_a_lambert_surface() -> None:
    world, sensor = room()
    for fixture in world.body(WALL).fixtures:
        fixture.material = Material(reflectance=0.8)
    scan = finder(FRONT).scan(sensor, 1, 1)
    assert scan.intensities == pytest.approx(
        255 * 0.8 * np.cos(FRONT) / (8 / np.cos(FRONT)) ** 2, rel=1e-4
    )


def test_a_reflectance_of_minus_0_is_black() -> None:
    world, sensor = room()
    add_edge(world, [3, -8, 3, 8], Material(reflectance=-0.0))
    add_edge(world, [-3, -8, -3, 8], MIRROR)
    scan = finder(FRONT).scan(sensor, 1, 1)
    assert scan.ranges == pytest.approx(3 / np.cos(FRONT), rel=1e-5)
    assert scan.intensities is not None
    assert (scan.intensities == 0).all()


def test_intensities_are_bounded_near_the_sensor_and_0_without_a_hit(world: PhysicsWorld) -> None:
    sensor = world.create_body("static", (0, 0, 0))
    add_edge(world, [0.1, -1, 0.1, 1], Material(reflectance=1.0))
    scan = finder([0.0, math.pi]).scan(sensor, 1, 1)
    assert scan.intensities == pytest.approx([255, 0])


def test_the_reflectance_layer_keeps_its_intensity() -> None:
    world, sensor = room()
    add_edge(world, [8, -1, 8, 1], None, bits=2)
    options = {"reflect_mask": 2, "mask": 3}
    before = finder(FRONT, **options).scan(sensor, 1, 1)
    add_box(world, (-3, 0, 0), Material())
    after = finder(FRONT, **options).scan(sensor, 1, 1)
    assert (after.ranges == before.ranges).all()
    is_marked = np.abs(8 * np.tan(FRONT)) < 0.99
    assert (after.intensities[is_marked] == 255).all()
    assert (before.intensities[is_marked] == 255).all()
    is_plain = np.abs(8 * np.tan(FRONT)) > 1.01
    assert (after.intensities[is_plain] < 2).all()
    assert (after.intensities[is_plain] > 0).all()


def test_the_reflectance_layer_has_full_intensity_in_a_mirror() -> None:
    world, sensor = room()
    add_edge(world, [-1, -1, -1, 1], MIRROR)
    add_edge(world, [3, 0, 3, 2], None, bits=2)
    angles = [math.pi - 0.1, math.pi + 0.1]  # the wall and the room, 4 and 9 m from the mirror
    scan = finder(angles, reflect_mask=2, mask=3).scan(sensor, 1, 1)
    assert scan.ranges * math.cos(0.1) == pytest.approx([5, 10], abs=1e-4)
    assert scan.intensities[0] == 255
    assert 0 < scan.intensities[1] < 2


# -- what beams hit ---------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_labels_equal_those_of_single_rays(seed: int) -> None:
    world, sensor = clutter(seed, lambda _: None)
    angles = np.linspace(-math.pi, math.pi, 721)
    scan = finder(angles).scan_labels(sensor, 1, 1)
    assert scan.ranges.tobytes() == finder(angles).scan(sensor, 1, 1).ranges.tobytes()
    for angle, label in zip(angles, scan.labels, strict=True):
        hit = world.ray_cast((0, 0), (LENGTH * math.cos(angle), LENGTH * math.sin(angle)))
        assert hit is not None
        assert scan.hits[label - 1] == (hit.fixture.body.id, hit.fixture.category_bits)


def test_of_coincident_walls_the_first_one_in_the_mask_is_labelled(world: PhysicsWorld) -> None:
    sensor = world.create_body("static", (0, 0, 0))
    walls = [add_edge(world, [3, -8, 3, 8], None, bits) for bits in (2, 4, 2)]
    for bits, wall in ((2, walls[0]), (4, walls[1])):
        scan = finder(FRONT, mask=bits).scan_labels(sensor, 1, 1)
        assert (scan.labels == 1).all()
        assert scan.hits == [(wall.id, bits)]


def test_readings_that_are_no_hits_have_no_label() -> None:
    _, sensor = room()
    noise = RangeNoise.beam(
        z_hit=0.5,
        z_short=0.2,
        z_max=0.2,
        z_rand=0.1,
        sigma_hit=0,
        lambda_short=1,
        max_range=LENGTH,
    )
    exact = finder(FRONT).scan(sensor, 1, 1).ranges
    scan = finder(FRONT, noise=noise).scan_labels(sensor, 1, 1)
    assert ((scan.labels == 1) == (scan.ranges == exact)).all()
    assert 300 < (scan.labels == 1).sum() < 700


# -- cones ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_a_cone_measures_the_nearest_hit_of_its_rays(seed: int) -> None:
    _, sensor = clutter(seed, lambda _: None)
    angles = np.linspace(-0.3, 0.3, 61)
    cone = finder(angles, is_cone=True).scan(sensor, 1, 1)
    assert cone.ranges.tolist() == [finder(angles).scan(sensor, 1, 1).ranges.min()]
    assert cone.intensities is None


def test_a_cone_does_not_contain_the_readings_of_an_earlier_scan() -> None:
    world, sensor = room()
    add_edge(world, [-1, -8, -1, 8], None)
    assert finder(np.full(64, math.pi)).scan(sensor, 1, 1).ranges.max() < 1.1
    cone = finder(np.linspace(-0.1, 0.1, 32), is_cone=True)  # a multiple of the width of a block
    assert cone.scan(sensor, 1, 1).ranges.min() > 7.9


def test_an_empty_cone_has_no_hit(world: PhysicsWorld) -> None:
    sensor = world.create_body("static", (0, 0, 0))
    cone = finder(FRONT, is_cone=True, no_hit=math.inf).scan(sensor, 1, 1)
    assert cone.ranges.tolist() == [math.inf]


# -- worlds -----------------------------------------------------------------------------------


def digest(world: PhysicsWorld, sensor: PhysicsBody) -> str:
    """Returns a hash of scans from several poses."""
    angles = np.linspace(-math.pi, math.pi, 500)
    h = hashlib.sha256()
    for update in range(20):
        sensor.set_pose(0.2 * update - 2, 0.1 * update, 0.3 * update)
        scan = finder(angles).scan(sensor, 9, update)
        assert scan.intensities is not None
        h.update(scan.ranges.tobytes() + scan.intensities.tobytes())
        h.update(finder(angles).scan_labels(sensor, 9, update).labels.tobytes())
    return h.hexdigest()


def test_copies_keep_materials() -> None:
    world, sensor = clutter(4, any_material)
    copy = world.copy()
    expected = digest(world, sensor)
    assert digest(copy, copy.body(sensor.id)) == expected
    sensor.set_pose(0, 0, 0)
    changed, body = room()
    changed.become_copy_of(copy)
    assert digest(changed, changed.body(body.id)) == expected


def test_batches_have_the_same_results_with_any_number_of_threads() -> None:
    world, _ = clutter(5, any_material)
    bodies = [world.create_body("static", (i / 10, -i / 20, i)) for i in range(40)]
    requests = [
        ScanRequest(finder(np.linspace(-3, 3, 301)), body, 7, update)
        for update, body in enumerate(bodies)
    ]
    single = [request.finder.scan(request.body, 7, request.update) for request in requests]
    for threads in (1, 2):
        for scan, alone in zip(scan_all(requests, None, threads), single, strict=True):
            assert scan.ranges.tobytes() == alone.ranges.tobytes()
            assert scan.intensities is not None
            assert alone.intensities is not None
            assert scan.intensities.tobytes() == alone.intensities.tobytes()


def test_a_world_is_plain_again_without_the_fixtures_that_have_a_material() -> None:
    world, sensor = room()
    plain = finder(FRONT).scan(sensor, 1, 1)
    assert plain.intensities is None
    box = add_box(world, (3, 0, 0), Material(0.2, 0.3, 0.4))
    assert world.has_materials
    assert box.fixtures[0].material == pytest.approx((0.2, 0.3, 0.4))
    assert world.body(WALL).fixtures[0].material is None
    box.destroy()
    assert not world.has_materials
    again = finder(FRONT).scan(sensor, 1, 1)
    assert again.intensities is None
    assert again.ranges.tobytes() == plain.ranges.tobytes()


def test_coincident_edges_of_different_materials_both_stop_beams() -> None:
    world, sensor = room()
    add_edge(world, [3, -8, 3, 8], Material(transmission=0.5), bits=1)
    add_edge(world, [3, -8, 3, 8], None, bits=2)
    ranges = finder(FRONT).scan(sensor, 1, 1).ranges
    assert ranges == pytest.approx(3 / np.cos(FRONT), rel=1e-5)


@pytest.mark.parametrize(
    ("material", "message"),
    [
        (Material(1.1, 0, 0), "reflectance must be from 0 to 1, got 1.1"),
        (Material(0.5, -0.1, 0), "transmission must be from 0 to 1, got -0.1"),
        (Material(0.5, 0, math.nan), "specular must be from 0 to 1, got nan"),
        (Material(0.5, 0.6, 0.5), "transmission \\+ specular must be at most 1, got 1.1"),
    ],
)
def test_invalid_materials_are_rejected(material: Material, message: str) -> None:
    world, _ = room()
    with pytest.raises(ValueError, match=message):
        world.body(WALL).set_material(material)
    with pytest.raises(ValueError, match=message):
        world.body(WALL).fixtures[0].material = material
    assert not world.has_materials
