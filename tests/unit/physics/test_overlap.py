"""Overlap queries, compared with closed forms and with the Minkowski difference of shapes."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flatland.errors import StaleHandleError
from flatland.physics import ALL_BITS, PhysicsBody, PhysicsFixture, PhysicsWorld, Pose

Points = npt.NDArray[np.float64]
SQUARE = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]


def disc(world: PhysicsWorld, x: float, y: float, radius: float, **options: int) -> PhysicsBody:
    body = world.create_body("dynamic", (x, y, 0))
    body.create_circle((0, 0), radius, density=1, **options)
    return body


def box(world: PhysicsWorld, pose: Pose, body_type: str = "dynamic") -> PhysicsBody:
    body = world.create_body(body_type, pose)
    body.create_polygon(SQUARE, density=1)
    return body


def wall(world: PhysicsWorld, *edges: tuple[float, float, float, float]) -> PhysicsBody:
    body = world.create_body("static", (0, 0, 0))
    body.create_edges(edges)
    return body


def gap(world: PhysicsWorld, body: PhysicsBody, pose: Pose) -> float:
    """Returns the smallest `least_gap` with which the pose is blocked, found by bisection."""
    low, high = -5.0, 5.0
    while high - low > 1e-6:
        middle = (low + high) / 2
        if world.overlapping_bodies([body], pose, least_gap=middle):
            high = middle
        else:
            low = middle
    return high


# -- closed forms -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ((3.0, 0.0, 0.0), 2.0),  # beside the face
        ((1.0, 0.0, 0.0), 0.0),  # face on face
        ((0.9, 0.0, 0.0), -0.1),
        ((0.9, 0.95, 0.0), -0.05),  # exit through the nearer side
        ((4.0, 5.0, 0.0), 5.0),  # corner to corner: 3, 4, 5
        ((0.0, 0.0, 0.0), -1.0),  # coincident
        ((0.5 + math.sqrt(0.5), 0.0, math.pi / 4), 0.0),  # corner on face
    ],
)
def test_gap_between_squares(world: PhysicsWorld, pose: Pose, expected: float) -> None:
    box(world, (0, 0, 0))
    body = box(world, (20, 20, 0))
    assert gap(world, body, pose) == pytest.approx(expected, abs=1e-5)


def test_a_closed_loop_of_edges_has_no_interior(world: PhysicsWorld) -> None:
    wall(world, (-2, -2, 2, -2), (2, -2, 2, 2), (2, 2, -2, 2), (-2, 2, -2, -2))
    body = box(world, (9, 9, 0))
    assert world.overlapping_bodies([body], (0, 0, 0)) == []
    assert len(world.overlapping_bodies([body], (1.6, 0, 0))) == 1


# -- fixtures that are considered ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("mine", "other", "counts"),
    [
        ({}, {}, True),
        ({"category_bits": 1, "mask_bits": 1}, {"category_bits": 3, "mask_bits": 3}, True),
        ({"category_bits": 1, "mask_bits": 1}, {"category_bits": 2, "mask_bits": 2}, False),
        ({"category_bits": 1, "mask_bits": 3}, {"category_bits": 2, "mask_bits": 2}, False),
        ({"category_bits": 1, "mask_bits": 0}, {}, False),
        ({}, {"category_bits": 1, "mask_bits": 0}, False),
        ({"is_sensor": True}, {}, False),
        ({}, {"is_sensor": True}, False),
    ],
)
def test_only_fixtures_that_can_collide_are_considered(
    world: PhysicsWorld, mine: dict[str, int], other: dict[str, int], counts: bool
) -> None:
    disc(world, 0, 0, 1, **other)
    body = disc(world, 9, 9, 1, **mine)
    assert bool(world.overlapping_bodies([body], (0.1, 0, 0))) is counts
    body.set_pose(0.1, 0, 0)
    world.step(1e-6, 1, 1)
    assert any(not contact.is_sensor for contact in world.contacts()) is counts


@pytest.mark.parametrize("mine", ["static", "kinematic", "dynamic"])
@pytest.mark.parametrize("other", ["static", "kinematic", "dynamic"])
def test_one_of_two_bodies_must_be_dynamic(world: PhysicsWorld, mine: str, other: str) -> None:
    box(world, (0, 0, 0), other)
    body = box(world, (9, 9, 0), mine)
    found = world.overlapping_bodies([body], (0, 0, 0))
    assert bool(found) is ("dynamic" in (mine, other))


@pytest.mark.parametrize("collide", [False, True])
def test_a_joint_can_prevent_the_collision(world: PhysicsWorld, collide: bool) -> None:
    first, second = box(world, (0, 0, 0)), box(world, (3, 0, 0))
    world.create_revolute_joint(first, second, (1.5, 0), (-1.5, 0), collide_connected=collide)
    assert bool(world.overlapping_bodies([second], (0.5, 0, 0))) is collide


def test_bodies_of_the_probe_move_together_and_ignore_each_other(world: PhysicsWorld) -> None:
    first, second = box(world, (10, 10, math.pi / 2)), box(world, (10, 10.2, math.pi / 2))
    arm = disc(world, 10, 13, 0.5)  # 3 m in front of the first body
    target, ignored = disc(world, 0, 3, 0.5), disc(world, 0, 3.1, 0.5)
    bodies = [first, second, arm]
    assert world.overlapping_bodies(bodies, (0, 0, math.pi / 2), ignored=[ignored]) == [target]
    assert world.overlapping_bodies(bodies, (0, 0, math.pi / 2)) == [target, ignored]
    assert world.overlapping_bodies(bodies, (0, 0, 0)) == []
    assert world.free_poses(
        bodies, [(0, 0, math.pi / 2), (0, 0, 0), (-3, 3, 0)], ignored=[ignored]
    ).tolist() == [False, True, False]


def test_discs_consider_their_layers_and_the_given_bodies(world: PhysicsWorld) -> None:
    walls = world.create_body("static", (0, 0, 0))
    walls.create_edges([(0, -5, 0, 5)], category_bits=1, mask_bits=1)
    stone = disc(world, 2, 0, 0.5, category_bits=2, mask_bits=2)
    poses = [(0.2, 0, 0), (1.0, 0, 0), (2.0, 0, 0)]
    assert world.free_discs(poses, 0.3, 3).tolist() == [False, True, False]
    assert world.free_discs(poses, 0.3, 1).tolist() == [False, True, True]
    assert world.free_discs(poses, 0.3, 2).tolist() == [True, True, False]
    assert world.free_discs(poses, 0.3, 3, ignored=[stone]).tolist() == [False, True, True]
    assert world.free_discs(poses, 0.3, 3, only=[stone]).tolist() == [True, True, False]
    assert world.free_discs(poses, 0.3, 3, only=[]).tolist() == [True, True, True]
    assert world.free_discs(poses, 0.3, 3, least_gap=0.25).tolist() == [False, False, False]


def test_all_categories_are_those_of_all_fixtures(world: PhysicsWorld) -> None:
    for bit in range(16):
        disc(world, bit, 0, 0.1, category_bits=1 << bit)
    poses = [(float(bit), 0.0, 0.0) for bit in range(17)]
    assert world.free_discs(poses, 0.1, ALL_BITS).tolist() == [False] * 16 + [True]


# -- random shapes ------------------------------------------------------------------------------


def core(body: PhysicsBody, fixture: PhysicsFixture) -> Points:
    """Returns the corners of a fixture or the center of a disc in the world frame, shape (n, 2)."""
    points = np.array([fixture.center]) if fixture.shape == "circle" else fixture.vertices
    x, y, theta = body.pose
    turn = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
    return np.asarray(points @ turn.T + (x, y))


def hull(points: Points) -> Points:
    """Returns the counter-clockwise convex hull, by Andrew's monotone chain."""
    ordered = sorted(map(tuple, points.tolist()))
    chains: list[list[tuple[float, ...]]] = []
    for run in (ordered, ordered[::-1]):
        chain: list[tuple[float, ...]] = []
        for p in run:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2:]
                if (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax) > 1e-12:
                    break
                chain.pop()
            chain.append(p)
        chains.append(chain[:-1] or chain)
    return np.array(chains[0] + chains[1])


def signed_distance(first: Points, second: Points) -> float:
    """Returns the distance of two convex hulls, or their negative penetration depth.

    This is the distance of the origin from the hull of all differences of their points.
    """
    corners = hull((second[:, np.newaxis] - first).reshape(-1, 2))
    along = np.roll(corners, -1, axis=0) - corners
    squares = np.maximum((along**2).sum(axis=1), 1e-300)
    fraction = np.clip(-(corners * along).sum(axis=1) / squares, 0, 1)
    nearest = np.hypot(*(corners + along * fraction[:, np.newaxis]).T).min()
    area = 0.5 * (corners[:, 0] * along[:, 1] - corners[:, 1] * along[:, 0])
    is_inside = len(corners) > 2 and (area > 0).all()
    return float(-nearest if is_inside else nearest)


def fixture_gap(
    a: PhysicsBody, fixture_a: PhysicsFixture, b: PhysicsBody, fixture_b: PhysicsFixture
) -> float:
    return (
        signed_distance(core(a, fixture_a), core(b, fixture_b))
        - fixture_a.radius
        - fixture_b.radius
    )


def add_shapes(rng: np.random.Generator, body: PhysicsBody, may_be_edge: bool) -> None:
    for _ in range(rng.integers(1, 4)):
        kind = rng.integers(0, 3 if may_be_edge else 2)
        if kind == 0:
            body.create_circle(rng.uniform(-0.5, 0.5, 2), rng.uniform(0.02, 0.6), density=1)
        elif kind == 1:
            angles = np.sort(rng.uniform(0, 0.9, 5) + np.arange(5)) / 5 * math.tau
            radii = rng.uniform(0.3, 0.8)
            body.create_polygon(
                radii * np.stack((np.cos(angles), np.sin(angles)), axis=1), density=1
            )
        else:
            body.create_edges(rng.uniform(-2, 2, (3, 4)))


@settings(max_examples=6, derandomize=True)
@given(seed=st.integers(0, 2**32), least_gap=st.sampled_from([-0.1, -0.005, 0.0, 0.3]))
def test_queries_agree_with_the_minkowski_difference(seed: int, least_gap: float) -> None:
    rng = np.random.default_rng(seed)
    world = PhysicsWorld()
    others = []
    for index in range(6):
        pose = (*rng.uniform(-3, 3, 2), rng.uniform(-4, 4))
        others.append(world.create_body("static" if index % 2 else "dynamic", pose))
        add_shapes(rng, others[-1], may_be_edge=index % 2 == 1)
    bodies = [world.create_body("dynamic", (9, 9, 1)), world.create_body("dynamic", (9.5, 9, 2))]
    for body in bodies:
        add_shapes(rng, body, may_be_edge=False)
    poses = np.column_stack((rng.uniform(-3, 3, (8, 2)), rng.uniform(-4, 4, 8)))
    is_free = world.free_poses(bodies, poses, least_gap=least_gap)
    found = [world.overlapping_bodies(bodies, tuple(p), least_gap=least_gap) for p in poses]
    assert is_free.tolist() == [not overlapped for overlapped in found]
    start, rest = bodies[0].pose, bodies[1].pose
    for pose, overlapped in zip(poses, found, strict=True):
        turn = pose[2] - start[2]
        c, s = math.cos(turn), math.sin(turn)
        dx, dy = rest[0] - start[0], rest[1] - start[1]
        bodies[0].set_pose(*pose)
        bodies[1].set_pose(pose[0] + c * dx - s * dy, pose[1] + s * dx + c * dy, rest[2] + turn)
        for other in others:
            least = min(
                fixture_gap(body, mine, other, theirs)
                for body in bodies
                for mine in body.fixtures
                for theirs in other.fixtures
            )
            if abs(least - least_gap) > 1e-4:  # within the rounding errors
                assert (other in overlapped) is (least < least_gap), least
        bodies[0].set_pose(*start)
        bodies[1].set_pose(*rest)


# -- invalid arguments --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("poses", "text"),
    [
        ([(0, 0)], r"poses must have shape \(n, 3\), got \(1, 2\)"),
        ((0, 0, 0), r"poses must have shape \(n, 3\), got \(3,\)"),
        ([(0, 0, 0), (0, math.nan, 0)], r"poses\[1, 1\] must be finite"),
        ([(1e300, 0, 0)], r"poses\[0, 0\] must be finite and within"),
    ],
)
def test_invalid_poses_are_rejected(world: PhysicsWorld, poses: object, text: str) -> None:
    body = disc(world, 0, 0, 1)
    with pytest.raises(ValueError, match=text):
        world.free_poses([body], poses)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=text):
        world.free_discs(poses, 1, 1)  # type: ignore[arg-type]


def test_invalid_numbers_and_bodies_are_rejected(world: PhysicsWorld) -> None:
    body = disc(world, 0, 0, 1)
    with pytest.raises(ValueError, match="pose must be finite"):
        world.overlapping_bodies([body], (0, math.inf, 0))
    with pytest.raises(ValueError, match="pose angle must be finite"):
        world.overlapping_bodies([body], (0, 0, math.nan))
    with pytest.raises(ValueError, match="least_gap must be finite"):
        world.overlapping_bodies([body], (0, 0, 0), least_gap=math.nan)
    with pytest.raises(ValueError, match="radius must not be negative"):
        world.free_discs([(0, 0, 0)], -1, 1)
    with pytest.raises(ValueError, match="bits"):
        world.free_discs([(0, 0, 0)], 1, 1 << 16)
    with pytest.raises(ValueError, match="bodies must not be empty"):
        world.free_poses([], [(0, 0, 0)])
    assert world.free_discs(np.empty((0, 3)), 1, 1).shape == (0,)
    gone = disc(world, 0, 0, 1)
    gone.destroy()
    for bodies, ignored in (([gone], []), ([body], [gone])):
        with pytest.raises(StaleHandleError):
            world.free_poses(bodies, [(0, 0, 0)], ignored=ignored)
    world.close()
    with pytest.raises(StaleHandleError):
        world.free_discs([(0, 0, 0)], 1, 1)
