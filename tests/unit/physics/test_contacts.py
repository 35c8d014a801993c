"""Contact events, current contacts and the pre-solve hook."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flatland.errors import StaleHandleError, WorldLockedError
from flatland.physics import (
    ContactEvent,
    OldManifold,
    PhysicsBody,
    PhysicsWorld,
    PreSolveContact,
)

STEP = 0.01


@pytest.fixture
def world(world: PhysicsWorld) -> PhysicsWorld:
    world.record_contacts = True
    return world


def add_wall(world: PhysicsWorld, x: float = 0.0) -> PhysicsBody:
    wall = world.create_body("static", (x, 0, 0))
    wall.create_edges([[0, -5, 0, 5]])
    return wall


def add_disc(world: PhysicsWorld, x: float, speed: float = 0.0, **options: Any) -> PhysicsBody:
    body = world.create_body("dynamic", (x, 0, 0))
    body.create_circle((0, 0), 0.5, **{"density": 1.0, **options})
    body.set_velocity(speed, 0, 0)
    return body


def run_until(world: PhysicsWorld, kind: str) -> list[ContactEvent]:
    """Steps until an event of a kind occurs and returns the events of that step."""
    for _ in range(1000):
        world.step(STEP, 10, 10)
        events = world.take_contact_events()
        if any(event.kind == kind for event in events):
            return events
    raise AssertionError(f"no {kind} in 1000 steps")


@pytest.mark.parametrize("has_hook", [False, True])
def test_velocity_and_position_iterations_are_those_of_the_solver(
    world: PhysicsWorld, has_hook: bool
) -> None:
    """The former change the velocities of overlapping discs, the latter separate them."""
    discs = [add_disc(world, 0.0), add_disc(world, 0.9)]
    if has_hook:
        world.pre_solve = lambda contact, old_manifold: None

    def gap() -> float:
        return discs[1].pose[0] - discs[0].pose[0]

    world.step(STEP, 10, 0)
    assert gap() == pytest.approx(0.9)
    world.step(STEP, 0, 10)
    separated = gap()
    assert separated > 0.91
    discs[0].set_velocity(0.1, 0.0, 0.0)
    world.step(STEP, 0, 0)
    assert discs[0].velocity[0] == pytest.approx(0.1)
    world.step(STEP, 10, 0)
    assert discs[0].velocity[0] == pytest.approx(0.05, abs=1e-3)
    assert gap() == pytest.approx(separated - 0.001, abs=1e-4)


def test_events_of_a_collision_from_begin_to_end(world: PhysicsWorld) -> None:
    wall = add_wall(world)
    disc = add_disc(world, -2, speed=2)
    begin, *rest = run_until(world, "begin")
    assert begin.kind == "begin"
    assert {begin.body_a, begin.body_b} == {wall.id, disc.id}
    assert {begin.fixture_a, begin.fixture_b} == {wall.fixtures[0].id, disc.fixtures[0].id}
    assert not begin.is_sensor
    assert begin.points.shape == (1, 2)
    np.testing.assert_allclose(begin.points, [[0, 0]], atol=0.03)
    towards_b = 1.0 if begin.body_b == wall.id else -1.0
    np.testing.assert_allclose(begin.normal, [towards_b, 0], atol=1e-6)
    assert begin.normal_impulses.tolist() == [0]

    # The wall absorbs the momentum of the disc, without friction.
    solved = [e for e in rest if e.kind == "post_solve"] or run_until(world, "post_solve")
    impulse = sum(float(e.normal_impulses.sum()) for e in solved)
    assert impulse == pytest.approx(2 * disc.mass, rel=1e-3)
    assert all(e.tangent_impulses.tolist() == [0] for e in solved)
    assert {e.contact_id for e in solved} == {begin.contact_id}

    disc.set_velocity(-1, 0, 0)
    (end,) = [e for e in run_until(world, "end") if e.kind == "end"]
    assert end.contact_id == begin.contact_id
    assert end.points.shape == (0, 2)
    assert end.normal.tolist() == [0, 0]
    assert world.contacts() == []


def test_friction_causes_a_tangent_impulse(world: PhysicsWorld) -> None:
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[0, -5, 0, 5]], friction=0.5)
    disc = add_disc(world, -0.505, friction=0.5)
    disc.set_velocity(2, 3, 0)
    solved = [e for e in run_until(world, "post_solve") if e.kind == "post_solve"]
    tangent = abs(sum(float(e.tangent_impulses.sum()) for e in solved))
    normal = sum(float(e.normal_impulses.sum()) for e in solved)
    assert tangent == pytest.approx(0.5 * normal, rel=1e-3)


def test_a_contact_of_two_faces_has_two_points(world: PhysicsWorld) -> None:
    wall = add_wall(world)
    box = world.create_body("dynamic", (-1.5, 0, 0))
    box.create_polygon([(-1, -0.5), (1, -0.5), (1, 0.5), (-1, 0.5)], density=1)
    box.set_velocity(1, 0, 0)
    begin = run_until(world, "begin")[0]
    assert sorted(begin.points[:, 1]) == pytest.approx([-0.5, 0.5], abs=1e-3)
    assert begin.points.dtype == np.float64
    assert {begin.body_a, begin.body_b} == {wall.id, box.id}
    (contact,) = world.contacts()
    assert sorted(contact.points[:, 1]) == pytest.approx([-0.5, 0.5], abs=1e-3)
    for name in ("contact_id", "body_a", "body_b", "fixture_a", "fixture_b"):
        assert getattr(contact, name) == getattr(begin, name)


def test_sensors_begin_and_end_without_points(world: PhysicsWorld) -> None:
    zone = world.create_body("static", (0, 0, 0))
    zone.create_circle((0, 0), 1.0, density=0, is_sensor=True)
    disc = add_disc(world, -3, speed=3)
    (begin,) = run_until(world, "begin")
    assert begin.is_sensor
    assert begin.points.shape == (0, 2)
    assert world.contacts()[0].is_sensor
    (end,) = run_until(world, "end")
    assert end.is_sensor
    assert end.contact_id == begin.contact_id
    assert disc.velocity == pytest.approx((3, 0, 0)), "a sensor does not push"


def test_events_are_recorded_only_on_request(world: PhysicsWorld) -> None:
    world.record_contacts = False
    add_wall(world)
    disc = add_disc(world, -1, speed=2)
    for _ in range(100):
        world.step(STEP, 10, 10)
    assert world.take_contact_events() == []
    (live,) = world.contacts()
    # A contact that began before the recording keeps its id.
    world.record_contacts = True
    disc.set_velocity(-1, 0, 0)
    events = run_until(world, "end")
    assert {event.contact_id for event in events} == {live.contact_id}
    assert "begin" not in {event.kind for event in events}


@pytest.mark.parametrize("which", ["wall", "disc"])
def test_destroying_a_body_ends_its_contacts(world: PhysicsWorld, which: str) -> None:
    bodies = {"wall": add_wall(world), "disc": add_disc(world, -1, speed=2)}
    begin = run_until(world, "begin")[0]
    bodies[which].destroy()
    (end,) = world.take_contact_events()
    assert end.kind == "end"
    for name in ("contact_id", "body_a", "body_b", "fixture_a", "fixture_b"):
        assert getattr(end, name) == getattr(begin, name)
    world.step(STEP, 10, 10)
    assert world.take_contact_events() == []


def test_each_contact_has_a_unique_id(world: PhysicsWorld) -> None:
    add_wall(world)
    disc = add_disc(world, -1, speed=2)
    numbers = []
    for _ in range(3):
        numbers.append(run_until(world, "begin")[0].contact_id)
        disc.set_velocity(-2, 0, 0)
        run_until(world, "end")
        disc.set_velocity(2, 0, 0)
    assert len(set(numbers)) == 3


# -- pre_solve -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("start", "passes"), [(-2, True), (2, False)])
def test_a_gate_that_can_be_passed_in_one_direction(
    world: PhysicsWorld, start: float, passes: bool
) -> None:
    gate = add_wall(world)
    disc = add_disc(world, start, speed=-start)

    def only_to_the_right(contact: PreSolveContact, _: OldManifold) -> None:
        contact.enabled = disc.velocity[0] < 0

    world.pre_solve = only_to_the_right
    world.pre_solve_bodies = {gate.id}
    for _ in range(300):
        world.step(STEP, 10, 10)
    assert (disc.pose[0] * start < 0) == passes
    assert world.take_pre_solve_errors() == []


def test_pre_solve_is_called_only_for_contacts_of_the_given_bodies(world: PhysicsWorld) -> None:
    near, far = add_disc(world, -1, speed=2), add_disc(world, 8, speed=2)
    add_wall(world)
    wall = add_wall(world, 9)
    seen: list[tuple[int, int]] = []
    world.pre_solve = lambda contact, _: seen.append((contact.body_a, contact.body_b))
    world.pre_solve_bodies.add(far.id)
    for _ in range(100):
        world.step(STEP, 10, 10)
    assert {frozenset(pair) for pair in seen} == {frozenset((wall.id, far.id))}
    world.pre_solve_bodies = {near.id}
    near.set_velocity(0.1, 0, 0)
    seen.clear()
    world.step(STEP, 10, 10)
    assert near.id in seen[0]


def test_arguments_of_pre_solve(world: PhysicsWorld) -> None:
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[0, -5, 0, 5]], friction=0.25, restitution=0.5)
    disc = add_disc(world, -1, speed=2, friction=1.0)
    seen: list[dict[str, Any]] = []

    def record(contact: PreSolveContact, old: OldManifold) -> None:
        seen.append(
            {
                "id": contact.contact_id,
                "fixtures": {contact.fixture_a, contact.fixture_b},
                "points": contact.points,
                "normal": contact.normal,
                "mixed": (contact.enabled, contact.friction, contact.restitution),
                "speed": contact.tangent_speed,
                "old": (old.points, old.normal_impulses, old.tangent_impulses, old.kind),
                "frame": (old.local_normal, old.local_point),
                "pose": disc.pose,
            }
        )

    world.pre_solve = record
    world.pre_solve_bodies = {disc.id}
    begin = run_until(world, "begin")[0]
    first = seen[0]
    assert first["id"] == begin.contact_id
    assert first["fixtures"] == {wall.fixtures[0].id, disc.fixtures[0].id}
    np.testing.assert_array_equal(first["points"], begin.points)
    np.testing.assert_array_equal(first["normal"], begin.normal)
    assert first["mixed"] == pytest.approx((True, 0.5, 0.5))
    assert first["speed"] == 0
    assert (first["old"][0].shape, first["old"][3]) == ((0, 2), "none")
    assert first["frame"][0].tolist() == first["frame"][1].tolist() == [0, 0]
    assert first["pose"][0] == pytest.approx(-0.5, abs=0.05)
    for _ in range(3):
        disc.set_velocity(1, 0, 0)
        world.step(STEP, 10, 10)
    points, normal_impulses, tangent_impulses, kind = seen[-1]["old"]
    assert points.shape == (1, 2)
    assert normal_impulses.shape == tangent_impulses.shape == (1,)
    assert kind in {"circles", "face_a", "face_b"}
    assert seen[-1]["frame"][0].shape == seen[-1]["frame"][1].shape == (2,)


def test_invalid_values_are_rejected_in_pre_solve(world: PhysicsWorld) -> None:
    wall = add_wall(world)
    add_disc(world, -0.505, speed=2)
    world.pre_solve_bodies = {wall.id}
    for name, value in [("friction", -1), ("friction", float("nan")), ("restitution", -1)]:
        world.pre_solve = lambda contact, _, n=name, v=value: setattr(contact, n, v)
        world.step(STEP, 10, 10)
        errors = world.take_pre_solve_errors()
        assert errors
        assert all(isinstance(error, ValueError) and name in str(error) for error in errors)


def test_a_closed_world_and_a_copy_have_no_pre_solve(world: PhysicsWorld) -> None:
    world.pre_solve = lambda *_: None
    copy = world.copy()
    assert copy.pre_solve is None
    assert copy.take_pre_solve_errors() == []
    assert world.pre_solve is not None
    world.close()
    assert world.pre_solve is None


def test_errors_in_pre_solve_are_returned_after_the_step(world: PhysicsWorld) -> None:
    wall = add_wall(world)
    disc = add_disc(world, -1, speed=2)

    def fail(_contact: PreSolveContact, _old: OldManifold) -> None:
        raise RuntimeError("broken gate")

    world.pre_solve = fail
    world.pre_solve_bodies = {wall.id}
    run_until(world, "begin")
    errors = world.take_pre_solve_errors()
    assert [str(error) for error in errors] == ["broken gate"] * len(errors)
    assert errors[0].__traceback__ is not None
    assert world.take_pre_solve_errors() == []
    for _ in range(20):
        world.step(STEP, 10, 10)
    assert disc.pose[0] < -0.45, "the contact must be solved without changes"


@pytest.mark.parametrize(
    "change",
    [
        lambda world, disc: world.create_body("static", (0, 0, 0)),
        lambda world, disc: disc.destroy(),
        lambda world, disc: disc.set_pose(0, 0, 0),
        lambda world, disc: disc.set_velocity(0, 0, 0),
        lambda world, disc: disc.apply_torque(1),
        lambda world, disc: disc.create_circle((0, 0), 1, density=1),
        lambda world, disc: disc.create_edges([[0, 0, 1, 1]]),
        lambda world, disc: setattr(disc, "awake", True),
        lambda world, disc: setattr(disc.fixtures[0], "is_sensor", True),
        lambda world, disc: setattr(disc.fixtures[0], "mask_bits", 0),
        lambda world, disc: world.cast_rays((0, 0, 0), [[1, 0]], 0xFFFF),
        lambda world, disc: world.step(0.01, 1, 1),
        lambda world, disc: world.take_contact_events(),
        lambda world, disc: setattr(world, "record_contacts", False),
        lambda world, disc: world.close(),
    ],
)
def test_pre_solve_cannot_change_the_world(world: PhysicsWorld, change: Any) -> None:
    wall = add_wall(world)
    disc = add_disc(world, -0.505, speed=2)
    world.pre_solve = lambda *_: change(world, disc)
    world.pre_solve_bodies = {wall.id}
    world.step(STEP, 10, 10)
    errors = world.take_pre_solve_errors()
    assert errors
    assert all(isinstance(error, WorldLockedError) for error in errors)
    assert "the world is stepping" in str(errors[0])
    world.pre_solve = None
    world.step(STEP, 10, 10)


def test_a_contact_is_stale_after_pre_solve(world: PhysicsWorld) -> None:
    wall = add_wall(world)
    add_disc(world, -0.505, speed=2)
    kept: list[PreSolveContact] = []
    world.pre_solve = lambda contact, _: kept.append(contact)
    world.pre_solve_bodies = {wall.id}
    world.step(STEP, 10, 10)
    assert kept[0].points.shape == (1, 2)
    with pytest.raises(StaleHandleError, match="only during the call of pre_solve"):
        kept[0].enabled = False


def test_a_collector_continues_after_another_one_of_its_body_is_removed(
    world: PhysicsWorld,
) -> None:
    wall, disc = add_wall(world), add_disc(world, -0.6, speed=2)
    world.own_bodies([wall, disc], True)
    removed, remaining = world.collect_touches([disc]), world.collect_touches([disc])
    removed.remove()
    run_until(world, "begin")
    assert remaining.touched
    assert len(remaining) == 1
