"""Revolute and weld joints."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from flatland.errors import StaleHandleError
from flatland.physics import PhysicsBody, PhysicsWorld

STEP = 0.005


def box(world: PhysicsWorld, x: float = 0.0, body_type: str = "dynamic") -> PhysicsBody:
    body = world.create_body(body_type, (x, 0, 0))
    body.create_polygon([(-0.5, -0.2), (0.5, -0.2), (0.5, 0.2), (-0.5, 0.2)], density=1)
    return body


def run(world: PhysicsWorld, seconds: float) -> None:
    for _ in range(round(seconds / STEP)):
        world.step(STEP, 20, 20)


def test_a_revolute_joint_holds_the_anchors_together(world: PhysicsWorld) -> None:
    post, door = box(world, 0, "static"), box(world, 1)
    joint = world.create_revolute_joint(post, door, (0.5, 0), (-0.5, 0))
    assert (joint.type, joint.body_a, joint.body_b) == ("revolute", post, door)
    assert joint.anchors.tolist() == [[0.5, 0], [-0.5, 0]]
    assert (joint.limits, joint.collide_connected, joint.reference_angle) == (None, False, 0)
    assert post.joints == door.joints == [joint]
    door.set_velocity(0, 0.5, 1)
    run(world, 1)
    x, y, theta = door.pose
    assert (x - 0.5 * math.cos(theta), y - 0.5 * math.sin(theta)) == pytest.approx(
        (0.5, 0), abs=0.01
    )
    assert theta > 0.5


def test_a_new_joint_wakes_both_bodies(world: PhysicsWorld) -> None:
    bodies = box(world), box(world, 3)
    for body in bodies:
        body.awake = False
    world.create_revolute_joint(*bodies, (1.5, 0), (-1.5, 0))
    assert [body.awake for body in bodies] == [True, True]


def test_limits_restrict_the_angle(world: PhysicsWorld) -> None:
    post, door = box(world, 0, "static"), box(world, 1)
    joint = world.create_revolute_joint(post, door, (0.5, 0), (-0.5, 0), limits=(-0.25, 0.5))
    assert joint.limits == (-0.25, 0.5)
    for torque, angle in [(3, 0.5), (-3, -0.25)]:
        for _ in range(400):
            door.apply_torque(torque)
            world.step(STEP, 20, 20)
        assert door.pose[2] == pytest.approx(angle, abs=0.02)
    joint.set_limits(1.0, 1.0)
    assert joint.limits == (1.0, 1.0)
    run(world, 2)
    assert door.pose[2] == pytest.approx(1.0, abs=0.02)
    joint.clear_limits()
    assert joint.limits is None
    door.set_velocity(0, 0, 2)
    run(world, 1)
    assert door.pose[2] > 1.5


def test_connected_bodies_collide_only_on_request(world: PhysicsWorld) -> None:
    pairs = []
    for i, collide in enumerate((False, True)):
        a = world.create_body("dynamic", (0, 10 * i, 0))
        b = world.create_body("dynamic", (0.6, 10 * i, 0))
        for body in (a, b):
            body.create_circle((0, 0), 0.5, density=1)
        joint = world.create_revolute_joint(a, b, (0, 1), (0, 1), collide_connected=collide)
        assert joint.collide_connected == collide
        # Replace the joint by one whose anchors coincide, so that it exerts no force.
        joint.destroy()
        joint = world.create_revolute_joint(a, b, (0.3, 0), (-0.3, 0), collide_connected=collide)
        pairs.append((a, b))
    world.step(STEP, 20, 20)
    touching = {frozenset((c.body_a, c.body_b)) for c in world.contacts()}
    assert touching == {frozenset(body.id for body in pairs[1])}


def test_rigidly_welded_bodies_move_as_one(world: PhysicsWorld) -> None:
    a, b = box(world), box(world, 1)
    joint = world.create_weld_joint(a, b, (0.5, 0), (-0.5, 0))
    assert (joint.type, joint.frequency, joint.damping, joint.limits) == ("weld", 0, 0, None)
    b.set_velocity(0, 1, 0)
    run(world, 1)
    assert a.pose[2] == pytest.approx(b.pose[2], abs=0.01)
    assert np.hypot(*(np.array(a.pose) - b.pose)[:2]) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("frequency", [0, 10])
def test_a_welded_body_without_mass_is_carried_along(world: PhysicsWorld, frequency: float) -> None:
    """The robots of the reference have welded wheels and sensors with a density of 0."""
    robot = box(world)
    wheel = world.create_body("dynamic", (1, 0, 0))
    wheel.create_circle((0, 0), 0.2, density=0)
    world.create_weld_joint(robot, wheel, (1, 0), (0, 0), frequency=frequency, damping=0.5)
    for _ in range(200):
        robot.set_velocity(0.5, 0, 0)
        world.step(0.01, 10, 10)
    assert robot.pose == pytest.approx((1, 0, 0), abs=0.02)
    assert wheel.pose == pytest.approx((2, 0, 0), abs=0.02)


def test_a_weld_maintains_its_reference_angle(world: PhysicsWorld) -> None:
    a = box(world, 0, "static")
    b = world.create_body("dynamic", (0, 5, 0.5))
    b.create_circle((0, 0), 0.3, density=1)
    joint = world.create_weld_joint(a, b, (0, 5), (0, 0), reference_angle=0.5)
    assert joint.reference_angle == 0.5
    run(world, 1)
    assert b.pose == pytest.approx((0, 5, 0.5), abs=0.01)


def test_a_weld_with_a_spring_oscillates_at_its_frequency(world: PhysicsWorld) -> None:
    """The frequency is converted to the stiffness that Box2D 2.4 requires."""
    wall = world.create_body("static", (0, 0, 0))
    rotor = world.create_body("dynamic", (0, 0, 0.2))
    rotor.create_circle((0, 0), 0.5, density=3)
    joint = world.create_weld_joint(wall, rotor, (0, 0), (0, 0), frequency=1.0, damping=0.0)
    assert (joint.frequency, joint.damping) == (1.0, 0.0)
    angles = []
    for _ in range(1000):
        world.step(0.001, 20, 20)
        angles.append(rotor.pose[2])
    crossings = np.nonzero(np.diff(np.sign(angles)))[0]
    assert crossings[:2] * 0.001 == pytest.approx([0.25, 0.75], abs=0.02)


@pytest.mark.parametrize(
    "change",
    [
        lambda rotor: rotor.scale_shapes(0.5),
        lambda rotor: setattr(rotor.fixtures[0], "density", 30.0),
        lambda rotor: rotor.create_circle((0, 0), 1.0, density=1.0),
    ],
)
def test_a_spring_keeps_its_frequency_when_the_mass_of_a_body_changes(
    world: PhysicsWorld, change: Callable[[PhysicsBody], object]
) -> None:
    def angles(is_changed_before: bool) -> list[float]:
        wall = world.create_body("static", (0, 0, 0))
        rotor = world.create_body("dynamic", (0, 0, 0.2))
        rotor.create_circle((0, 0), 0.5, density=3, mask_bits=0)
        if is_changed_before:
            change(rotor)
        world.create_weld_joint(wall, rotor, (0, 0), (0, 0), frequency=1.0, damping=0.1)
        if not is_changed_before:
            change(rotor)
        found = []
        for _ in range(200):
            world.step(0.005, 20, 20)
            found.append(rotor.pose[2])
        rotor.destroy()
        return found

    assert angles(False) == angles(True)


def test_a_damped_weld_comes_to_rest(world: PhysicsWorld) -> None:
    wall = world.create_body("static", (0, 0, 0))
    rotor = world.create_body("dynamic", (0, 0, 0.2))
    rotor.create_circle((0, 0), 0.5, density=3)
    joint = world.create_weld_joint(wall, rotor, (0, 0), (0, 0), frequency=2.0, damping=1.0)
    assert joint.damping == 1.0
    run(world, 2)
    assert rotor.pose[2] == pytest.approx(0, abs=1e-3)


def test_a_destroyed_joint_releases_its_bodies(world: PhysicsWorld) -> None:
    post, door = box(world, 0, "static"), box(world, 1)
    joint = world.create_weld_joint(post, door, (0.5, 0), (-0.5, 0))
    joint.destroy()
    assert not joint.alive
    assert post.joints == []
    with pytest.raises(StaleHandleError, match="the joint was destroyed"):
        _ = joint.type
    with pytest.raises(StaleHandleError):
        joint.destroy()
    door.set_velocity(1, 0, 0)
    run(world, 1)
    assert door.pose[0] == pytest.approx(2, abs=0.01)
