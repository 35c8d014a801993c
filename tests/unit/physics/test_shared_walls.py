"""Worlds that share their walls have the results of worlds with walls of their own."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from flatland.physics import PhysicsBody, PhysicsWorld, Run

DT = 0.005
STEP = (DT, 10, 10)
SIZE = 40.0  # m, of the square in which the walls are
ALL = 0xFFFF


def octagon(x: float, y: float, radius: float) -> npt.NDArray[np.float64]:
    """Returns the edges of an octagon, shape (8, 4)."""
    angles = np.arange(9) * (math.pi / 4)
    points = np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], axis=1)
    return np.hstack([points[:-1], points[1:]])


def building() -> PhysicsWorld:
    """Returns a world with a square of walls and a pillar every 4 m, on two layers."""
    world = PhysicsWorld()
    world.record_contacts = True
    outer = world.create_body("static", (0.0, 0.0, 0.0))
    s = SIZE
    outer.create_edges(
        np.array([(0, 0, s, 0), (s, 0, s, s), (s, s, 0, s), (0, s, 0, 0)], np.float32)
    )
    pillars = world.create_body("static", (0.3, 0.2, 0.1))
    places = np.arange(4.0, SIZE - 3.0, 4.0)
    edges = [octagon(x, y, 0.4 + 0.02 * x) for x in places for y in places]
    pillars.create_edges(np.concatenate(edges).astype(np.float32), category_bits=2)
    return world


def pair() -> tuple[PhysicsWorld, PhysicsWorld]:
    """Returns equal worlds, of which the second one shares its walls."""
    own, shared = building(), building()
    shared.share_walls()
    assert own.shared_fixtures == 0
    assert shared.shared_fixtures == shared.object_counts().fixtures > 600
    return own, shared


def bodies_of(world: PhysicsWorld) -> list[PhysicsBody]:
    """Returns the bodies of a world in which none was destroyed, oldest first."""
    return [world.body(1 << 60 | slot) for slot in range(world.object_counts().bodies)]


def add_ball(
    world: PhysicsWorld, x: float, y: float, vx: float = 0.0, vy: float = 0.0
) -> PhysicsBody:
    ball = world.create_body("dynamic", (x, y, 0.0))
    ball.create_circle((0.0, 0.0), 0.2, density=1.0, restitution=1.0)
    ball.set_velocity(vx, vy, 0.3)
    return ball


def state_of(world: PhysicsWorld) -> tuple[bytes, list[str]]:
    """Returns the states of bodies and the contacts that touch, in any order, with all digits."""
    contacts = [
        repr((c.fixture_a, c.fixture_b, c.points.tobytes(), c.normal.tobytes()))
        for c in world.contacts()
    ]
    return world.body_states().tobytes(), sorted(contacts)


def test_all_queries_include_distant_walls() -> None:
    own, shared = pair()
    for world in (own, shared):
        add_ball(world, 2.0, 2.0)
        world.step(*STEP)
    rng = np.random.default_rng(0)
    poses = np.column_stack([rng.uniform(-1, SIZE + 1, (400, 2)), rng.uniform(-3, 3, 400)])
    angles = np.linspace(0, math.tau, 72)
    ends = (6 * np.stack([np.cos(angles), np.sin(angles)], axis=1)).astype(np.float32)

    def answers(world: PhysicsWorld) -> list[object]:
        outer, pillars, ball = bodies_of(world)
        found: list[object] = [
            world.free_discs(poses, 0.7, ALL).tolist(),
            world.free_discs(poses, 0.7, ALL, only=[pillars]).tolist(),
            world.free_discs(poses, 0.7, ALL, ignored=[pillars]).tolist(),
            world.free_poses([ball], poses).tolist(),
            [
                [body.id for body in world.overlapping_bodies([ball], tuple(pose))]
                for pose in poses[:100]
            ],
            [repr(world.ray_cast(pose[:2], (pose[0] + 5, pose[1] + 1), 2)) for pose in poses],
            [world.cast_rays(tuple(p), ends, ALL, 2)[0].tobytes() for p in poses[:50]],
            [world.cast_rays_reference(tuple(p), ends, ALL, 2)[0].tobytes() for p in poses[:50]],
            outer.edges().tolist(),
            pillars.edges().tolist(),
            [(f.id, f.category_bits, f.vertices.tolist(), f.body.id) for f in pillars.fixtures],
            world.object_counts(),
        ]
        return found

    for of_own, of_shared in zip(answers(own), answers(shared), strict=True):
        assert of_own == of_shared
    assert shared.shared_fixtures > 0


def partners(world: PhysicsWorld) -> dict[int, set[int]]:
    """Returns the fixtures that each body touched in the last step, by id of the body."""
    touched: dict[int, set[int]] = {body.id: set() for body in bodies_of(world)}
    for each in (*world.contacts(), *world.take_contact_events()):
        touched[each.body_a].add(each.fixture_b)
        touched[each.body_b].add(each.fixture_a)
    return touched


@pytest.mark.parametrize("speed", [5.0, 20.0, 250.0])
def test_bodies_bounce_off_the_same_walls(speed: float) -> None:
    """The fastest ones move by 1.25 m in a step, farther than the cells of walls are wide.

    The solver processes several contacts of a body in another order. In the next step, such a body
    is in the same state again.
    """
    own, shared = pair()
    for world in (own, shared):
        for i in range(6):
            angle = 0.7 + i
            add_ball(world, 6 + 4 * i, 6.0, speed * math.cos(angle), speed * math.sin(angle))
    touches = 0
    for _ in range(2000):
        for world in (own, shared):
            world.step(*STEP)
        touched, touched_shared = partners(own), partners(shared)
        for ball, other in list(zip(bodies_of(own), bodies_of(shared), strict=True))[2:]:
            if len(touched[ball.id]) < 2 and len(touched_shared[ball.id]) < 2:
                assert (ball.pose, ball.velocity) == (other.pose, other.velocity)
                assert touched[ball.id] == touched_shared[ball.id]
                touches += len(touched[ball.id])
                continue
            assert math.dist(ball.pose[:2], other.pose[:2]) < 0.02 + speed * DT
            pose, velocity = ball.pose, ball.velocity
            for each in (ball, other):
                each.set_pose(*pose)
                each.set_velocity(*velocity)
    assert touches > 20
    assert shared.shared_fixtures > 0


def test_a_body_touches_walls_at_the_place_to_which_it_is_moved() -> None:
    own, shared = pair()
    balls = [add_ball(world, 2.0, 2.0) for world in (own, shared)]
    rng = np.random.default_rng(1)
    touched = 0
    for x, y in rng.uniform(0.0, SIZE, (200, 2)).tolist():
        for ball in balls:
            ball.set_pose(x, y, 0.0)
        own.find_new_contacts()
        shared.find_new_contacts()
        assert shared.object_counts().contacts == own.object_counts().contacts
        for world in (own, shared):
            world.step(*STEP)
        touched += len(own.contacts())
        assert len(own.contacts()) == len(shared.contacts())
        # Several walls are corrected in another order.
        for ball in balls:
            ball.set_velocity(0.0, 0.0, 0.0)
    assert touched > 20
    assert shared.shared_fixtures > 0


def test_a_body_that_is_hit_stops_at_a_wall() -> None:
    """A fast kinematic body drives a ball, which is at rest, against a distant wall."""
    own, shared = pair()
    for world in (own, shared):
        add_ball(world, 6.0, 2.0)
        hammer = world.create_body("kinematic", (3.0, 2.0, 0.0))
        hammer.create_circle((0.0, 0.0), 0.3, density=0.0)
        hammer.set_velocity(120.0, 0.0, 0.0)
    for _ in range(60):
        own.step(*STEP)
        shared.step(*STEP)
        assert state_of(own) == state_of(shared)
    ball = bodies_of(shared)[2]
    assert 0.0 < ball.pose[0] < SIZE
    assert abs(ball.velocity[0]) > 50.0


def test_a_body_cannot_pass_a_distant_wall_in_the_step_in_which_it_is_hit() -> None:
    """The ball, at rest, is 1.8 m from the wall, and would move by 2 m in the step."""
    own, shared = pair()
    for world in (own, shared):
        ball = add_ball(world, SIZE - 2.0, 2.0)
        hammer = world.create_body("kinematic", (SIZE - 2.5, 2.0, 0.0))
        hammer.create_circle((0.0, 0.0), 0.3, density=0.0)
        world.step(*STEP)
        assert len(world.contacts()) == 1
        hammer.set_velocity(200.0, 0.0, 0.0)
        world.step(*STEP)
        assert ball.velocity[0] == pytest.approx(-400.0, rel=0.01)
    assert state_of(own) == state_of(shared)


def test_a_body_that_becomes_much_faster_than_expected_hits_the_next_wall() -> None:
    """With a restitution of 20, the ball leaves the outer wall at 300 m/s and hits a pillar."""
    own, shared = pair()
    for world in (own, shared):
        ball = world.create_body("dynamic", (0.24, 4.6, 0.0))
        ball.create_circle((0.0, 0.0), 0.2, density=1.0, restitution=20.0)
        ball.set_velocity(-15.0, 0.0, 0.0)
    speeds = []
    for _ in range(3):
        for world in (own, shared):
            world.step(*STEP)
        assert state_of(own) == state_of(shared)
        speeds.append(bodies_of(shared)[2].velocity[0])
    assert max(speeds) == pytest.approx(300.0, rel=0.01)
    assert min(speeds) < -500.0


def change_pose(pillars: PhysicsBody) -> None:
    pillars.set_pose(0.0, 0.0, 0.0)


def change_filter(pillars: PhysicsBody) -> None:
    for fixture in pillars.fixtures[:300]:
        fixture.mask_bits = 0


def change_friction(pillars: PhysicsBody) -> None:
    for fixture in pillars.fixtures:
        fixture.friction = 0.0


def add_walls(pillars: PhysicsBody) -> None:
    pillars.create_edges(octagon(2.0, 2.0, 0.5).astype(np.float32))


def destroy(pillars: PhysicsBody) -> None:
    pillars.destroy()


@pytest.mark.parametrize(
    "change", [change_pose, change_filter, change_friction, add_walls, destroy]
)
def test_changed_walls_are_not_shared(change: Callable[[PhysicsBody], None]) -> None:
    own, shared = pair()
    copy = shared.copy()
    for world in (own, shared):
        for i in range(6):
            add_ball(world, 2.0 + 4 * i, 2.0, 8.0, 3.0)
        for _ in range(40):
            world.step(*STEP)
        change(bodies_of(world)[1])
    assert shared.shared_fixtures == 0
    assert copy.shared_fixtures > 600
    for _ in range(400):
        own.step(*STEP)
        shared.step(*STEP)
        assert state_of(own) == state_of(shared)
    assert bodies_of(own)[0].edges().tolist() == bodies_of(shared)[0].edges().tolist()
    # The copy has the walls of before.
    assert bodies_of(copy)[1].edges().tolist() == bodies_of(building())[1].edges().tolist()
    assert len(bodies_of(copy)[1].fixtures) == copy.object_counts().fixtures - 4


def test_walls_that_a_controller_moves_are_not_shared() -> None:
    own, shared = building(), building()
    for world in (own, shared):
        world.record_contacts = False  # a contact would end the run
        add_ball(world, 0.25, 2.0)
        bodies_of(world)[0].control_tween(
            (1.0, 0.0, 0.0), duration=1.0, mode="loop", easing="linear"
        )
    shared.share_walls()
    for world in (own, shared):
        world.jobs.run(*Run(0, 5_000_000, 100, DT, 10, 10))
    assert shared.shared_fixtures == 0
    assert bodies_of(shared)[0].pose[0] > 0.4
    assert state_of(own) == state_of(shared)


def test_contacts_with_walls_end_and_begin_again() -> None:
    world = building()
    ball = add_ball(world, 0.19, 2.0)
    world.step(*STEP)
    assert len(world.contacts()) == 1
    world.take_contact_events()
    world.share_walls()
    assert [event.kind for event in world.take_contact_events()] == ["end"]
    ball.set_pose(0.19, 2.0, 0.0)
    world.step(*STEP)
    assert len(world.contacts()) == 1


def test_a_world_with_few_walls_becomes_one_with_many() -> None:
    """The array of the broad phase of the first one is too small."""
    start = building()
    start.share_walls()
    for i in range(3):
        add_ball(start, 2.0, 2.0 + 4 * i, 20.0, 3.0 + i)
    world, other = start.copy(), start.copy()
    for _ in range(300):
        world.step(*STEP)
    for _ in range(2):
        other.become_copy_of(world)
        for _ in range(100):
            world.step(*STEP)
            other.step(*STEP)
            assert state_of(world) == state_of(other)
        other.become_copy_of(start)
        assert state_of(other) == state_of(start)
    assert world.shared_fixtures > 0


def test_walls_outlive_the_world_that_shared_them() -> None:
    world = building()
    world.share_walls()
    copy = world.copy()
    again = copy.copy()
    world.close()
    copy.clear()
    ball = add_ball(again, 1.0, 2.0, -3.0, 0.0)
    for _ in range(200):
        again.step(*STEP)
    assert ball.velocity[0] > 0.0


def test_only_static_bodies_of_edges_without_joints_are_shared() -> None:
    world = building()
    box = world.create_body("static", (5.0, 2.0, 0.0))
    box.create_edges(np.array([(0, 0, 1, 0)], np.float32))
    box.create_circle((0.0, 0.0), 0.1, density=0.0)
    hinge = world.create_body("static", (7.0, 2.0, 0.0))
    hinge.create_edges(np.array([(0, 0, 1, 0)], np.float32))
    ball = add_ball(world, 7.0, 2.0)
    world.create_revolute_joint(hinge, ball, (0.0, 0.0), (0.0, 0.0))
    moving = world.create_body("kinematic", (9.0, 2.0, 0.0))
    moving.create_edges(np.array([(0, 0, 1, 0)], np.float32))
    counts = [len(body.fixtures) for body in bodies_of(world)]
    world.share_walls()
    assert world.shared_fixtures == counts[0] + counts[1]
    assert [len(body.fixtures) for body in bodies_of(world)] == counts


@pytest.mark.parametrize("x", [-1000.0, 0.0, 5000.0])
def test_walls_may_be_anywhere(world: PhysicsWorld, x: float) -> None:
    walls = world.create_body("static", (x, -x, 0.0))
    walls.create_edges(octagon(0.0, 0.0, 3.0).astype(np.float32))
    walls.create_edges(octagon(0.2 * x, 0.0, 3.0).astype(np.float32))
    balls = [add_ball(world, each, -x, 2.0, 1.0) for each in (x, 1.2 * x)]
    world.share_walls()
    for _ in range(2000):
        world.step(*STEP)
    for ball, center in zip(balls, (x, 1.2 * x), strict=True):
        assert math.hypot(ball.pose[0] - center, ball.pose[1] + x) < 2.9
        assert math.hypot(*ball.velocity[:2]) > 1.0
    assert world.shared_fixtures > 0


def test_a_world_without_walls_shares_nothing(world: PhysicsWorld) -> None:
    add_ball(world, 0.0, 0.0)
    world.share_walls()
    assert world.shared_fixtures == 0
