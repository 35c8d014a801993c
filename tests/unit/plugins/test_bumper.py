"""Bumper: recorded contacts, times of messages, forces and directions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import flatland
from flatland import Collisions

DT = 0.005
DISC = """
- name: base
  footprints: [{type: circle, radius: 0.2, density: 10}]
"""
SQUARE = """
- name: base
  footprints:
    - {type: polygon, density: 10, points: [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]}
"""
WALL = """
bodies:
  - name: slab
    type: static
    footprints:
      - {type: polygon, density: 1, points: [[0, -1], [0.2, -1], [0.2, 1], [0, 1]]}
"""
PILLAR = """
bodies:
  - {name: post, type: static, footprints: [{type: circle, radius: 0.2, density: 1}]}
"""
BUMPER = "[{type: Bumper, name: bumper}]"

Collect = Callable[[flatland.World, str], list[Any]]


def put(world: flatland.World, files: Any, text: str, x: float, y: float = 0.0) -> None:
    """Spawns an obstacle."""
    world.spawn_model(files.write("obstacle.model.yaml", text), "obstacle", pose=(x, y, 0))


def touching(plugin_world: Any, files: Any, plugins: str = BUMPER, **options: Any) -> Any:
    """Returns a world whose robot overlaps a wall to its right by 1 mm, at x = 0.199."""
    world = plugin_world(plugins, **{"bodies": DISC, **options})
    put(world, files, WALL, 0.199)
    return world


@pytest.mark.parametrize(
    ("entry", "topic", "frame"),
    # The frame of the world has no namespace.
    [("", "/r1/collisions", "map"), ("topic: /hits, world_frame_id: earth", "/hits", "earth")],
)
def test_message(
    plugin_world: Any, files: Any, collect: Collect, entry: str, topic: str, frame: str
) -> None:
    world = touching(
        plugin_world, files, f"[{{type: Bumper, name: bumper, {entry}}}]", namespace="r1"
    )
    messages = collect(world, topic)
    world.step(2)
    assert [type(message) for message in messages] == [Collisions, Collisions]
    assert messages[0].frame_id == frame
    (collision,) = messages[0].collisions
    assert (collision.entity_a, collision.body_a) == ("robot", "base")
    assert (collision.entity_b, collision.body_b) == ("obstacle", "slab")


@pytest.mark.parametrize(
    ("entry", "wall_at", "steps"),
    [
        ("", 5.0, 10),  # empty lists at the update rate
        ("", 0.199, 1),  # contacts in every step
        ("publish_all_collisions: false", 0.199, 10),
    ],
)
def test_times_of_messages(
    plugin_world: Any, files: Any, collect: Collect, entry: str, wall_at: float, steps: int
) -> None:
    world = plugin_world(f"[{{type: Bumper, name: bumper, update_rate: 20, {entry}}}]", bodies=DISC)
    put(world, files, WALL, wall_at)
    messages = collect(world, "/collisions")
    world.step(40)
    stamps = [5_000_000 * step for step in range(steps, 41, steps)]
    assert [message.stamp for message in messages] == stamps
    assert {len(message.collisions) for message in messages} == {int(wall_at < 1.0)}


def test_a_late_subscriber_receives_existing_contacts(plugin_world: Any, files: Any) -> None:
    world = touching(plugin_world, files)
    world.step(20)
    output = world.output("/collisions")
    world.step()
    (collision,) = output.latest.collisions
    assert collision.entity_b == "obstacle"
    assert len(collision.magnitude_forces) == 1


def test_a_contact_of_a_body_that_sleeps_has_no_points(plugin_world: Any, files: Any) -> None:
    world = touching(plugin_world, files)
    output = world.output("/collisions")
    body = world.models[0].bodies[0]
    world.step()
    while body.physics.awake:
        (collision,) = output.latest.collisions
        assert len(collision.contact_positions) == 1
        world.step()
        assert world.time < 5.0
    assert world.time > 0.5
    world.step()
    (collision,) = output.latest.collisions
    assert (collision.entity_b, collision.body_b) == ("obstacle", "slab")
    sizes = map(len, (collision.contact_positions, collision.contact_normals))
    assert [*sizes, len(collision.magnitude_forces)] == [0, 0, 0]


def test_walls_of_a_layer(plugin_world: Any, files: Any) -> None:
    map_path = files.write_map("room", ["...", ".#.", "..."], origin="[0.2, -1.5, 0]")
    world = plugin_world(
        BUMPER, bodies=DISC, pose=(1.1, 0, 0), layers=f"[{{name: [room, floor], map: {map_path}}}]"
    )
    output = world.output("/collisions")
    world.step()
    (collision,) = output.latest.collisions
    # A layer and its body have the first name of the layer.
    assert (collision.entity_b, collision.body_b) == ("room", "room")
    assert collision.contact_normals == pytest.approx(np.array([[1.0, 0.0]]))


@pytest.mark.parametrize(
    ("bodies", "obstacle", "x"),
    # In Box2D polygons precede circles: the robot is body B of one contact and body A of the other.
    [(DISC, WALL, 0.199), (SQUARE, PILLAR, 0.399)],
)
def test_normals_point_from_this_body_to_the_other(
    plugin_world: Any, files: Any, bodies: str, obstacle: str, x: float
) -> None:
    world = plugin_world(BUMPER, bodies=bodies)
    put(world, files, obstacle, x)
    output = world.output("/collisions")
    world.step()
    (collision,) = output.latest.collisions
    assert collision.body_a == "base"
    assert collision.contact_normals == pytest.approx(np.array([[1.0, 0.0]]), abs=1e-5)
    # Box2D polygons have a skin of 1 cm, and a contact point is in the middle of the overlap.
    assert collision.contact_positions == pytest.approx(np.array([[0.2, 0.0]]), abs=0.01)
    (contact,) = world.contacts
    assert (contact.body_a.name == "base") == (bodies is SQUARE)


def test_force_at_rest_equals_the_applied_force(plugin_world: Any, files: Any) -> None:
    world = touching(plugin_world, files)
    output = world.output("/collisions")
    base = world.model("robot").body("base")
    for _ in range(100):
        base.apply_force((7.5, 0.0), base.pose[:2])
        world.step()
    (collision,) = output.latest.collisions
    assert collision.magnitude_forces == pytest.approx([7.5], rel=1e-3)


@pytest.mark.parametrize(
    ("wall_at", "solver_calls"),
    # Box2D solves a second time at the time of impact if the step would end within the wall. The
    # first call has removed all momentum by then, so that the mean is half of it.
    [(0.199, 1), (0.2005, 2)],
)
def test_two_corners_share_the_force(
    plugin_world: Any, files: Any, wall_at: float, solver_calls: int
) -> None:
    world = plugin_world(BUMPER, bodies=SQUARE)
    put(world, files, WALL, wall_at)
    base = world.model("robot").body("base")
    base.set_velocity(0.4, 0.0, 0.0)
    output = world.output("/collisions")
    world.step()
    (collision,) = output.latest.collisions
    force = base.mass * 0.4 / DT / solver_calls
    assert collision.magnitude_forces == pytest.approx([force / 2, force / 2], rel=1e-3)
    assert collision.contact_positions.shape == (2, 2)
    assert collision.contact_normals.shape == (2, 2)


def test_each_pair_of_fixtures_has_a_record_without_forces_of_sensors(
    plugin_world: Any, files: Any
) -> None:
    two = """
    - name: base
      footprints:
        - {type: circle, radius: 0.2, density: 10}
        - {type: circle, radius: 0.3, density: 0, sensor: true}
    """
    world = touching(plugin_world, files, bodies=two)
    output = world.output("/collisions")
    world.step()
    shapes = sorted(
        (c.magnitude_forces.shape, c.contact_positions.shape, c.contact_normals.shape)
        for c in output.latest.collisions
    )
    assert shapes == [((0,), (0, 2), (0, 2)), ((1,), (1, 2), (1, 2))]


@pytest.mark.parametrize(
    "end",
    [
        lambda world: world.move_model("robot", (-3, 0, 0)),
        lambda world: world.delete_model("obstacle"),
    ],
    ids=["moved", "other model deleted"],
)
def test_a_record_is_removed_at_the_end_of_the_contact(
    plugin_world: Any, files: Any, end: Callable[[flatland.World], None]
) -> None:
    world = touching(plugin_world, files)
    output = world.output("/collisions")
    world.step()
    assert len(output.latest.collisions) == 1
    end(world)
    world.step()
    assert output.latest.collisions == ()


def test_forces_are_those_of_this_step_only(plugin_world: Any, files: Any) -> None:
    world = touching(plugin_world, files)
    output = world.output("/collisions")
    world.step()
    base = world.model("robot").body("base")
    base.apply_force((3000.0, 0.0), base.pose[:2])
    world.step()
    strong = output.latest.collisions[0].magnitude_forces[0]
    world.step()
    weak = output.latest.collisions[0].magnitude_forces
    assert strong == pytest.approx(3000, rel=0.01)
    assert weak.shape == (1,)
    assert weak[0] < 1.0


TWO_BODIES = """
- name: base
  footprints: [{type: circle, radius: 0.2, density: 10}]
- name: arm
  pose: [0, 0.39, 0]
  footprints: [{type: circle, radius: 0.2, density: 10}]
"""


def test_contacts_between_bodies_of_the_model_are_recorded(plugin_world: Any) -> None:
    world = plugin_world(BUMPER, bodies=TWO_BODIES)
    output = world.output("/collisions")
    world.step()
    (collision,) = output.latest.collisions
    assert (collision.entity_a, collision.entity_b) == ("robot", "robot")
    assert {collision.body_a, collision.body_b} == {"base", "arm"}
    direction = 1.0 if collision.body_a == "base" else -1.0
    assert collision.contact_normals == pytest.approx(np.array([[0.0, direction]]), abs=1e-5)


@pytest.mark.parametrize(("exclude", "left"), [("[]", 3), ("[arm]", 1), ("[base]", 1)])
def test_contacts_of_excluded_bodies_are_ignored(
    plugin_world: Any, files: Any, exclude: str, left: int
) -> None:
    world = touching(
        plugin_world,
        files,
        f"[{{type: Bumper, name: bumper, exclude: {exclude}}}]",
        bodies=TWO_BODIES,
    )
    output = world.output("/collisions")
    world.step()
    assert len(output.latest.collisions) == left
