"""Copies of physics worlds are exact: the same steps and calls have the same results."""

from __future__ import annotations

import os
import random
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flatland.errors import StaleHandleError
from flatland.physics import PhysicsBody, PhysicsWorld

STEP = (0.005, 10, 10)
STEPS, STEPS_OF_A_STATE = 60, 6
# `make fuzz` draws this number of new examples again and again; the suite draws the same few in
# each run.
EXAMPLES = int(os.environ.get("FLATLAND_FUZZ", "0"))
PROPERTY = settings(
    max_examples=EXAMPLES or 3,
    deadline=None,
    derandomize=not EXAMPLES,
    suppress_health_check=list(HealthCheck),
)
SEEDS = st.integers(0, 2**32 - 1)


class Calls:
    """Random calls, the same for worlds with the same objects and a generator of the same seed."""

    def __init__(self, world: PhysicsWorld, seed: int) -> None:
        self.world = world
        self.rng = random.Random(seed)
        # Ids of bodies in their slots: those of all generations that these calls can reach.
        ids = [1 << 60 | generation << 32 | slot for slot in range(60) for generation in range(6)]
        self.known = [body for body in map(world.body, ids) if body.alive]

    def run(self, count: int) -> None:
        calls: list[Callable[[], object]] = [
            *[self.create_body] * 4,
            *[self.push] * 3,
            *[self.step] * 3,
            *[self.create_joint] * 2,
            self.create_wall,
            self.destroy_body,
            self.destroy_joint,
            self.move,
            self.put_to_sleep,
            self.change_filter,
            self.change_sensor,
            self.cast_rays,
            self.world.share_walls,
        ]
        for _ in range(count):
            self.rng.choice(calls)()

    def bodies(self) -> list[PhysicsBody]:
        return [body for body in self.known if body.alive]

    def any_body(self) -> PhysicsBody | None:
        found = self.bodies()
        return self.rng.choice(found) if found else None

    def pose(self) -> tuple[float, float, float]:
        uniform = self.rng.uniform
        return (uniform(-2, 2), uniform(-2, 2), uniform(-3, 3))

    def create_body(self) -> None:
        rng = self.rng
        kind = rng.choice(["dynamic", "dynamic", "dynamic", "kinematic", "static"])
        body = self.world.create_body(kind, self.pose(), linear_damping=rng.choice([0.0, 0.5]))
        self.known.append(body)
        options = {
            "density": rng.choice([0.0, 1.0, 5.0]),
            "friction": rng.random(),
            "restitution": rng.choice([0.0, 0.5]),
            "is_sensor": rng.random() < 0.1,
        }
        for _ in range(rng.randint(0, 3)):
            x, y = rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3)
            if rng.random() < 0.5:
                body.create_circle((x, y), rng.uniform(0.05, 0.4), **options)
            else:
                half = rng.uniform(0.1, 0.4)
                corners = [(x - half, y), (x + half, y), (x, y + half)]
                body.create_polygon(corners, **options)
        body.set_velocity(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-2, 2))

    def create_wall(self) -> None:
        wall = self.world.create_body("static", (0.0, 0.0, 0.0))
        self.known.append(wall)
        edges = np.array([[self.rng.uniform(-3, 3) for _ in range(4)] for _ in range(8)])
        wall.create_edges(edges.astype(np.float32))

    def create_joint(self) -> None:
        found = self.bodies()
        if len(found) < 2:
            return
        one, other = self.rng.sample(found, 2)
        anchors = ((0.1, 0.0), (-0.1, 0.0))
        connected = self.rng.random() < 0.5
        if self.rng.random() < 0.5:
            limits = self.rng.choice([None, (-0.5, 0.5)])
            self.world.create_revolute_joint(
                one, other, *anchors, limits=limits, collide_connected=connected
            )
        elif "dynamic" in (one.type, other.type):
            frequency = self.rng.choice([0.0, 2.0])
            self.world.create_weld_joint(
                one, other, *anchors, frequency=frequency, collide_connected=connected
            )

    def destroy_body(self) -> None:
        if (body := self.any_body()) is not None:
            body.destroy()

    def destroy_joint(self) -> None:
        if (body := self.any_body()) is not None and body.joints:
            self.rng.choice(body.joints).destroy()

    def push(self) -> None:
        if (body := self.any_body()) is not None:
            x, y, _ = body.pose
            body.apply_force((self.rng.uniform(-9, 9), 1.0), (x, y + 0.1))

    def move(self) -> None:
        if (body := self.any_body()) is not None:
            body.set_pose(*self.pose())

    def put_to_sleep(self) -> None:
        if (body := self.any_body()) is not None:
            body.awake = False

    def change_filter(self) -> None:
        if (body := self.any_body()) is not None and body.fixtures:
            self.rng.choice(body.fixtures).mask_bits = self.rng.choice([0, 0xFFFF])

    def change_sensor(self) -> None:
        if (body := self.any_body()) is not None and body.fixtures:
            self.rng.choice(body.fixtures).is_sensor = self.rng.random() < 0.5

    def step(self) -> None:
        for _ in range(self.rng.randint(1, 40)):
            self.world.step(*STEP)

    def cast_rays(self) -> None:
        self.world.cast_rays(self.pose(), np.array([(4.0, 0.0), (0.0, 4.0)], np.float32), 0xFFFF)


def state_of(world: PhysicsWorld) -> str:
    """Returns everything that can be observed of a world, with all digits."""
    contacts = [
        (c.contact_id, c.fixture_a, c.fixture_b, c.points.tobytes(), c.normal.tobytes())
        for c in world.contacts()
    ]
    events = [
        (e.kind, e.contact_id, e.fixture_a, e.fixture_b, e.normal_impulses.tobytes())
        for e in world.take_contact_events()
    ]
    angles = np.linspace(0.0, 2 * np.pi, 90)
    ends = (5.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)).astype(np.float32)
    fractions, _ = world.cast_rays((0.1, 0.2, 0.3), ends, 0xFFFF)
    return repr((world.object_counts(), contacts, events, world.body_states().tobytes())) + str(
        fractions.tobytes()
    )


def random_world(seed: int) -> PhysicsWorld:
    world = PhysicsWorld()
    world.record_contacts = True
    calls = Calls(world, seed)
    calls.create_wall()
    calls.run(60)
    return world


def add_circle(world: PhysicsWorld, rng: random.Random) -> PhysicsBody:
    body = world.create_body("dynamic", (rng.uniform(-5, 5), rng.uniform(-5, 5), 0.0))
    body.create_circle((0.0, 0.0), 0.1, density=1.0)
    return body


def step_all(*worlds: PhysicsWorld) -> None:
    for _ in range(STEPS // STEPS_OF_A_STATE):
        for world in worlds:
            for _ in range(STEPS_OF_A_STATE):
                world.step(*STEP)
        first, *others = map(state_of, worlds)
        for other in others:
            assert other == first


@PROPERTY
@given(seed=SEEDS)
def test_a_world_can_be_reverted_again_and_again(seed: int) -> None:
    """As long as only poses and velocities change, nothing else is copied."""
    world = random_world(seed)
    source = world.copy()
    calls = Calls(world, seed)
    for changes in (
        [calls.push, calls.step, calls.put_to_sleep],
        [calls.push, calls.step, calls.move],  # static bodies, too
        [calls.push, calls.step, calls.change_filter, calls.change_sensor],
        [calls.create_body, calls.destroy_body, calls.create_joint, calls.destroy_joint],
        [calls.push, calls.step],
        [world.share_walls, calls.push, calls.step, calls.change_filter],
    ):
        for _ in range(12):
            calls.rng.choice(changes)()
        world.become_copy_of(source)
        assert state_of(world) == state_of(source)
    step_all(world, source.copy())


def test_each_fixture_is_reverted_to_its_own_values(world: PhysicsWorld) -> None:
    body = world.create_body("dynamic", (0.0, 0.0, 0.0))
    for x in (0.0, 1.0, 2.0):
        body.create_circle((x, 0.0), 0.1 + 0.1 * x, density=1.0 + x, friction=0.1 * x)

    def values() -> list[float]:
        numbers = [(each.density, each.friction, each.radius) for each in body.fixtures]
        return [body.mass, *sum(numbers, ())]

    before, source = values(), world.copy()
    for _ in range(2):
        for fixture in body.fixtures:
            fixture.friction = 0.9
        world.become_copy_of(source)
        assert values() == before
        body.fixtures[0].density = 5.0
        world.become_copy_of(source)
        assert values() == before
        body.scale_shapes(3.0)
        world.become_copy_of(source)
        assert values() == before
        body.create_circle((3.0, 0.0), 0.1, density=1.0)
        world.become_copy_of(source)
        assert values() == before


@PROPERTY
@given(seed=SEEDS, later=SEEDS)
def test_the_same_calls_have_the_same_results_in_a_copy(seed: int, later: int) -> None:
    world = random_world(seed)
    copy = world.copy()
    assert state_of(copy) == state_of(world)
    for each in (world, copy):
        Calls(each, later).run(40)
    step_all(world, copy)


@PROPERTY
@given(seed=SEEDS, later=SEEDS)
def test_a_world_becomes_what_it_was(seed: int, later: int) -> None:
    world = random_world(seed)
    copy, frozen = world.copy(), world.copy()
    for _ in range(2):
        Calls(world, later).run(40)
        world.become_copy_of(frozen)
    step_all(world, copy)


@PROPERTY
@given(seed=SEEDS, removed=st.integers(0, 30), added=st.integers(0, 120))
def test_a_copy_with_a_smaller_tree_grows_like_its_original(
    seed: int, removed: int, added: int
) -> None:
    """The array of the nodes of the broad phase of a copy has only a few free nodes."""
    world = random_world(seed)
    rng = random.Random(seed)
    bodies = [add_circle(world, rng) for _ in range(40)]
    for body in rng.sample(bodies, removed):
        body.destroy()
    copy = world.copy()
    state = rng.getstate()
    for each in (world, copy):
        rng.setstate(state)
        for _ in range(added):
            add_circle(each, rng)
    step_all(world, copy)
    world.become_copy_of(copy)
    step_all(world, copy)


def test_a_reverted_world_without_free_nodes_grows_like_its_original() -> None:
    rng = random.Random(1)
    source = PhysicsWorld()
    for _ in range(8):
        add_circle(source, rng)
    world = source.copy()  # with 47 nodes, which 24 circles use
    for _ in range(16):
        add_circle(world, rng)
    copy = world.copy()
    world.step(*STEP)
    world.become_copy_of(copy)
    state = rng.getstate()
    for each in (world, copy):
        rng.setstate(state)
        for _ in range(20):
            add_circle(each, rng)
    step_all(world, copy)


@PROPERTY
@given(seed=SEEDS)
def test_a_cleared_world_is_like_a_new_one(seed: int) -> None:
    world = random_world(seed)
    world.clear()
    assert world.object_counts() == (0, 0, 0, 0)
    fresh = PhysicsWorld()
    for each in (world, fresh):
        each.record_contacts = True
        for x in (0.0, 0.3, 0.5):
            body = each.create_body("dynamic", (x, 0.0, 0.0))
            body.create_circle((0.0, 0.0), 0.2, density=1.0)
    for _ in range(STEPS):
        world.step(*STEP)
        fresh.step(*STEP)
        assert np.array_equal(world.body_states(), fresh.body_states())


def test_a_copy_is_independent() -> None:
    world = random_world(3)
    before = world.body_states()
    copy = world.copy()
    for _ in range(50):
        copy.step(*STEP)
    copy.create_body("dynamic", (0.0, 0.0, 0.0))
    assert np.array_equal(world.body_states(), before)
    world.close()
    copy.step(*STEP)
    assert not copy.closed


def test_the_jobs_of_a_copy_step_the_copy() -> None:
    world, restored = PhysicsWorld(), PhysicsWorld()
    body = world.create_body("dynamic", (0, 0, 0))
    body.create_circle((0, 0), 0.2, density=1.0)
    controller = body.control_velocity()
    controller.set_target(1.0, 0.0, 0.5)
    copy = world.copy()
    restored.become_copy_of(world)
    start = body.pose
    for other in (copy, restored):
        assert other.jobs.run(0, 5_000_000, 20, 0.005, 8, 3)[0] == 20
        assert body.pose == start
        assert other.body(body.id).pose[0] == pytest.approx(0.1, abs=1e-3)
    assert world.jobs.run(0, 5_000_000, 20, 0.005, 8, 3)[0] == 20
    assert body.pose == copy.body(body.id).pose == restored.body(body.id).pose


def test_ids_stay_valid_only_for_objects_that_exist_again(world: PhysicsWorld) -> None:
    kept, deleted = (world.create_body("dynamic", (x, 0.0, 0.0)) for x in (0.0, 1.0))
    fixture = kept.create_circle((0.0, 0.0), 0.1, density=1.0)
    frozen = world.copy()
    deleted.destroy()
    newer = world.create_body("dynamic", (5.0, 0.0, 0.0))  # in the slot of the deleted one
    newest = world.create_body("dynamic", (6.0, 0.0, 0.0))
    world.become_copy_of(frozen)
    assert kept.alive
    assert fixture.alive
    assert deleted.pose == (1.0, 0.0, 0.0)
    for body in (newer, newest):
        with pytest.raises(StaleHandleError):
            _ = body.pose
    # The ids are not used again, either.
    deleted.destroy()
    again = [world.create_body("dynamic", (0.0, 0.0, 0.0)) for _ in range(2)]
    assert len({kept.id, deleted.id, newer.id, newest.id, *(body.id for body in again)}) == 6


def test_a_closed_world_cannot_be_copied() -> None:
    world, other = PhysicsWorld(), PhysicsWorld()
    world.close()
    for call, arguments in (
        (world.copy, ()),
        (other.become_copy_of, (world,)),
        (world.become_copy_of, (other,)),
    ):
        with pytest.raises(StaleHandleError, match="the world is closed"):
            call(*arguments)
