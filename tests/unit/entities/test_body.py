"""Bodies and joints of models as handles of the physics."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from flatland import Body, Joint
from flatland.entities.body import Entity
from flatland.errors import StaleHandleError
from flatland.physics import PhysicsWorld

COLOR = (0.1, 0.2, 0.3, 0.4)


@pytest.fixture
def world() -> Iterator[PhysicsWorld]:
    world = PhysicsWorld()
    yield world
    world.close()


@pytest.fixture
def bodies(world: PhysicsWorld) -> tuple[Body, Body]:
    owner = Entity()
    owner.name = "cart"
    base, wheel = (
        Body(world.create_body("dynamic", (x, 0, 0), linear_damping=0.5), owner, name, COLOR)
        for x, name in enumerate(("base", "wheel"))
    )
    return base, wheel


def test_a_body_is_a_handle_with_a_name_an_owner_and_a_color(bodies: tuple[Body, Body]) -> None:
    base, _ = bodies
    assert base.physics is base
    assert (base.type, base.linear_damping, base.angular_damping) == ("dynamic", 0.5, 0)
    assert (base.name, base.entity.name, base.color) == ("base", "cart", COLOR)
    assert repr(base) == "<Body 'base' of 'cart'>"


def test_bodies_are_equal_to_the_handles_of_the_same_physics_body(
    bodies: tuple[Body, Body],
) -> None:
    base, wheel = bodies
    base.create_circle((0, 0), 0.1, density=1)
    handle = base.fixtures[0].body
    assert handle == base
    assert base != wheel
    assert {base: "base", wheel: "wheel"}[handle] == "base"


def test_a_body_of_a_model_that_was_deleted_can_still_be_a_key(bodies: tuple[Body, Body]) -> None:
    base, wheel = bodies
    names = {base: "base", wheel: "wheel"}
    base.destroy()
    assert names.pop(base) == "base"
    assert names == {wheel: "wheel"}
    with pytest.raises(StaleHandleError):
        _ = base.pose


def test_points_with_a_third_coordinate_are_accepted_by_apply_force(
    world: PhysicsWorld, bodies: tuple[Body, Body]
) -> None:
    base, _ = bodies
    base.apply_force((2, 0, 9), (0, 0, 9))
    world.step(0.5, 1, 1)
    assert base.velocity[0] == pytest.approx(1 / 1.25)


def test_a_joint_is_the_handle_of_its_physics_joint(
    world: PhysicsWorld, bodies: tuple[Body, Body]
) -> None:
    base, wheel = bodies
    handle = world.create_revolute_joint(base, wheel, (0.5, 0), (-0.5, 0), limits=(-1, 1))
    joint = Joint(handle, "axle", bodies, COLOR)
    assert (joint.name, joint.bodies, joint.color) == ("axle", bodies, COLOR)
    assert (joint.type, joint.limits, joint.collide_connected) == ("revolute", (-1, 1), False)
    assert joint.anchors.tolist() == [[0.5, 0], [-0.5, 0]]
    assert (joint.body_a, joint.body_b) == bodies
    assert joint.physics is joint
    assert joint == handle
    assert hash(joint) == hash(handle)
    assert repr(joint) == "<revolute joint 'axle'>"
