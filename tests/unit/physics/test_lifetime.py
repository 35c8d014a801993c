"""Lifetimes: the use of a stale handle raises an exception."""

from __future__ import annotations

import copy
import gc
import weakref
from collections.abc import Callable

import pytest

from flatland.errors import StaleHandleError
from flatland.physics import PhysicsBody, PhysicsFixture, PhysicsJoint, PhysicsWorld, Touches

BODY_USES: list[Callable[[PhysicsBody], object]] = [
    lambda b: b.pose,
    lambda b: b.velocity,
    lambda b: b.set_pose(0, 0, 0),
    lambda b: b.set_velocity(0, 0, 0),
    lambda b: b.apply_force((0, 0), (0, 0)),
    lambda b: b.apply_torque(0),
    lambda b: b.type,
    lambda b: b.awake,
    lambda b: setattr(b, "awake", True),
    lambda b: b.mass,
    lambda b: b.inertia,
    lambda b: b.local_center,
    lambda b: b.world_center,
    lambda b: b.linear_damping,
    lambda b: b.angular_damping,
    lambda b: b.fixtures,
    lambda b: b.joints,
    lambda b: b.edges(),
    lambda b: b.create_circle((0, 0), 1, density=1),
    lambda b: b.create_polygon([(0, 0), (1, 0), (0, 1)], density=1),
    lambda b: b.create_edges([[0, 0, 1, 1]]),
    lambda b: b.destroy(),
    lambda b: b.world.create_weld_joint(b, b, (0, 0), (0, 0)),
]
FIXTURE_USES: list[Callable[[PhysicsFixture], object]] = [
    lambda f: f.body,
    lambda f: f.shape,
    lambda f: f.vertices,
    lambda f: f.center,
    lambda f: f.radius,
    lambda f: f.density,
    lambda f: f.friction,
    lambda f: f.restitution,
    lambda f: f.is_sensor,
    lambda f: setattr(f, "is_sensor", True),
    lambda f: f.category_bits,
    lambda f: setattr(f, "category_bits", 1),
    lambda f: f.mask_bits,
    lambda f: setattr(f, "mask_bits", 1),
]
JOINT_USES: list[Callable[[PhysicsJoint], object]] = [
    lambda j: j.type,
    lambda j: j.body_a,
    lambda j: j.body_b,
    lambda j: j.anchors,
    lambda j: j.collide_connected,
    lambda j: j.limits,
    lambda j: j.set_limits(0, 1),
    lambda j: j.clear_limits(),
    lambda j: j.reference_angle,
    lambda j: j.frequency,
    lambda j: j.damping,
    lambda j: j.destroy(),
]
WORLD_USES: list[Callable[[PhysicsWorld], object]] = [
    lambda w: w.step(0.01, 1, 1),
    lambda w: w.create_body("static", (0, 0, 0)),
    lambda w: w.ray_cast((0, 0), (1, 0)),
    lambda w: w.cast_rays((0, 0, 0), [[1, 0]], 1),
    lambda w: w.cast_rays_reference((0, 0, 0), [[1, 0]], 1),
    lambda w: w.contacts(),
    lambda w: w.take_contact_events(),
    lambda w: setattr(w, "record_contacts", True),
]


def make_pair(world: PhysicsWorld) -> tuple[PhysicsBody, PhysicsBody, PhysicsFixture, PhysicsJoint]:
    a, b = (world.create_body("dynamic", (x, 0, 0)) for x in (0, 3))
    fixture = a.create_circle((0, 0), 1, density=1)
    return a, b, fixture, world.create_revolute_joint(a, b, (0, 0), (0, 0))


class Tracked(PhysicsWorld):
    """A world that supports weak references."""


def test_destroying_a_body_destroys_its_fixtures_and_joints(world: PhysicsWorld) -> None:
    a, b, fixture, joint = make_pair(world)
    a.create_edges([[0, 0, 1, 1]])
    edge = a.fixtures[1]
    a.destroy()
    assert (a.alive, b.alive) == (False, True)
    assert not any(handle.alive for handle in (fixture, edge, joint))
    assert b.joints == []
    for use, handle, kind in (
        *((use, a, "body") for use in BODY_USES),
        *((use, fixture, "fixture") for use in FIXTURE_USES),
        *((use, joint, "joint") for use in JOINT_USES),
    ):
        with pytest.raises(StaleHandleError, match=f"the {kind} was destroyed"):
            use(handle)
    world.step(0.01, 1, 1)
    assert b.pose[0] == pytest.approx(3)


def test_all_handles_of_a_closed_world_are_stale(world: PhysicsWorld) -> None:
    a, b, fixture, joint = make_pair(world)
    world.close()
    world.close()
    assert world.closed
    assert not any(handle.alive for handle in (a, b, fixture, joint))
    uses: list[tuple[Callable[..., object], object]] = [
        *((use, world) for use in WORLD_USES),
        *((use, a) for use in BODY_USES),
        *((use, fixture) for use in FIXTURE_USES),
        *((use, joint) for use in JOINT_USES),
    ]
    for use, subject in uses:
        with pytest.raises(StaleHandleError, match="the world is closed"):
            use(subject)


def test_ids_are_not_reused(world: PhysicsWorld) -> None:
    seen: list[PhysicsBody | PhysicsFixture] = []
    for _ in range(100):
        body = world.create_body("dynamic", (0, 0, 0))
        seen += [body, body.create_circle((0, 0), 1, density=1)]
        assert [handle.alive for handle in seen[-2:]] == [True, True]
        assert not any(handle.alive for handle in seen[:-2])
        body.destroy()
    assert len({handle.id for handle in seen}) == len(seen)


def test_handles_remain_stale_after_the_world_was_cleared(world: PhysicsWorld) -> None:
    def make_all() -> list[PhysicsBody | PhysicsFixture | PhysicsJoint | Touches]:
        pair = make_pair(world)
        return [*pair, world.collect_touches(pair[:1])]

    before = make_all()
    world.clear()
    after = make_all()
    assert [handle.alive for handle in after] == [True] * 5
    assert not any(handle.alive for handle in before)


def test_the_id_of_an_object_of_another_kind_is_invalid(world: PhysicsWorld) -> None:
    body = world.create_body("static", (0, 0, 0))
    fixture = body.create_circle((0, 0), 1, density=0)
    assert not PhysicsBody(world, fixture.id).alive
    assert not PhysicsFixture(world, body.id).alive
    assert not PhysicsJoint(world, body.id).alive
    assert not PhysicsBody(world, 0).alive
    assert not PhysicsBody(world, 2**63 - 1).alive


def test_handles_are_compared_by_world_and_id() -> None:
    worlds = PhysicsWorld(), PhysicsWorld()
    bodies = [world.create_body("static", (0, 0, 0)) for world in worlds]
    assert bodies[0].id == bodies[1].id
    assert bodies[0] != bodies[1]
    assert len(set(bodies)) == 2
    fixture = bodies[0].create_circle((0, 0), 1, density=0)
    assert bodies[0].fixtures[0] == fixture == bodies[0].fixture(fixture.id)
    assert len({bodies[0].fixtures[0], fixture}) == 1
    assert fixture.body == bodies[0]
    assert fixture != fixture.id


def test_a_deep_copy_refers_to_the_copied_world_if_there_is_one(world: PhysicsWorld) -> None:
    class Named(PhysicsBody):
        __slots__ = ("names",)

        def __init__(self, body: PhysicsBody, names: list[str]) -> None:
            super().__init__(body.world, body.id)
            self.names = names

    body = world.create_body("dynamic", (1, 2, 0))
    named = Named(body, ["hull"])
    assert copy.deepcopy(body) is copy.copy(body) is body
    copied = world.copy()
    memo: dict[int, object] = {id(world): copied}
    twin = copy.deepcopy([body, named, named], memo)
    assert [type(handle) for handle in twin] == [PhysicsBody, Named, Named]
    assert all(handle == copied.body(body.id) for handle in twin)
    assert twin[1] is twin[2]
    assert twin[1].names == ["hull"]
    assert twin[1].names is not named.names
    twin[0].set_pose(5, 0, 0)
    assert (named.pose, twin[1].pose) == ((1, 2, 0), (5, 0, 0))


def test_objects_of_another_world_are_refused(world: PhysicsWorld) -> None:
    stranger = PhysicsWorld().create_body("dynamic", (0, 0, 0))
    with pytest.raises(ValueError, match="belongs to another physics world"):
        world.motions([stranger])
    with pytest.raises(TypeError, match="expected bodies"):
        world.motions([None])  # type: ignore[list-item]


def test_a_world_in_a_reference_cycle_is_freed() -> None:
    world = Tracked()
    body = world.create_body("static", (0, 0, 0))
    world.pre_solve = lambda *_, body=body: body.pose
    reference = weakref.ref(world)
    del world, body
    gc.collect()
    assert reference() is None


def test_handles_keep_their_world_alive() -> None:
    world = PhysicsWorld()
    body = world.create_body("dynamic", (1, 2, 0))
    fixture = body.create_circle((0, 0), 1, density=1)
    del world, body
    gc.collect()
    assert fixture.body.pose == (1, 2, 0)
    fixture.body.world.step(0.01, 1, 1)


def test_results_outlive_the_world() -> None:
    world = PhysicsWorld()
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[1, -1, 1, 1]])
    disc = world.create_body("dynamic", (0.2, 0, 0))
    disc.create_circle((0, 0), 1, density=1)
    world.record_contacts = True
    world.step(0.01, 1, 1)
    events, contacts = world.take_contact_events(), world.contacts()
    edges, vertices = wall.edges(), wall.fixtures[0].vertices
    fractions, _ = world.cast_rays((-5, 0, 0), [[10, 0]], 0xFFFF)
    hit = world.ray_cast((-5, 0), (5, 0))
    world.close()
    del world, wall, disc
    gc.collect()
    assert events[0].points.shape == contacts[0].points.shape == (1, 2)
    assert hit is not None
    assert fractions[0] == hit.fraction
    assert edges.tolist() == [[1, -1, 1, 1]]
    assert vertices.tolist() == [[1, -1], [1, 1]]
    with pytest.raises(StaleHandleError):
        _ = hit.fixture.shape


def test_a_world_without_references_is_freed() -> None:
    world = Tracked()
    world.create_body("static", (0, 0, 0)).create_edges([[0, 0, 1, 1]])
    reference = weakref.ref(world)
    del world
    assert reference() is None, "without help of the garbage collector"


def test_objects_that_were_created_since_are_listed() -> None:
    world = PhysicsWorld()
    assert (world.newest_objects, world.objects_since((0, 0))) == ((0, 0), ([], []))
    first, second = (world.create_body("dynamic", (0, 0, 0)) for _ in range(2))
    world.create_weld_joint(first, second, (0, 0), (0, 0))
    newest = world.newest_objects
    assert world.objects_since(newest) == ([], [])
    third, fourth = (world.create_body("dynamic", (0, 0, 0)) for _ in range(2))
    joint = world.create_weld_joint(first, third, (0, 0), (0, 0))
    assert world.objects_since(newest) == ([fourth.id, third.id], [joint.id])
    third.destroy()
    assert world.objects_since(newest) == ([fourth.id], [])
    second.destroy()  # It is not known any more what came after this body and its joint.
    assert world.objects_since(newest) == ([], [])
    world.close()
    with pytest.raises(StaleHandleError):
        _ = world.newest_objects
    with pytest.raises(StaleHandleError):
        world.objects_since((0, 0))
