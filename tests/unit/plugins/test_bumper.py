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


def test_defaults(plugin_world: Any, files: Any, collect: Collect) -> None:
    world = touching(plugin_world, files, namespace="r1")
    messages = collect(world, "/r1/collisions")
    world.step(2)
    assert [type(message) for message in messages] == [Collisions, Collisions]
    # World frames have no namespace.
    assert messages[0].frame_id == "map"
    (collision,) = messages[0].collisions
    assert (collision.entity_a, collision.body_a) == ("robot", "base")
    assert (collision.entity_b, collision.body_b) == ("obstacle", "slab")


def test_topic_and_frame(plugin_world: Any, files: Any) -> None:
    world = touching(
        plugin_world, files, "[{type: Bumper, name: b, topic: /hits, world_frame_id: earth}]"
    )
    output = world.output("/hits")
    world.step()
    assert output.latest.frame_id == "earth"


def test_empty_lists_are_published_at_the_update_rate(plugin_world: Any, collect: Collect) -> None:
    world = plugin_world("[{type: Bumper, name: bumper, update_rate: 20}]")
    messages = collect(world, "/collisions")
    world.step(200)
    assert [message.stamp for message in messages] == [50_000_000 * i for i in range(1, 21)]
    assert all(message.collisions == () for message in messages)


def test_contacts_are_published_in_every_step(
    plugin_world: Any, files: Any, collect: Collect
) -> None:
    world = touching(plugin_world, files, "[{type: Bumper, name: bumper, update_rate: 20}]")
    messages = collect(world, "/collisions")
    world.step(40)
    assert len(messages) == 40


def test_without_publish_all_collisions_the_update_rate_holds(
    plugin_world: Any, files: Any, collect: Collect
) -> None:
    world = touching(
        plugin_world,
        files,
        "[{type: Bumper, name: b, update_rate: 20, publish_all_collisions: false}]",
    )
    messages = collect(world, "/collisions")
    world.step(40)
    assert [message.stamp for message in messages] == [50_000_000 * i for i in range(1, 5)]
    assert all(len(message.collisions) == 1 for message in messages)


def test_a_late_subscriber_receives_existing_contacts(plugin_world: Any, files: Any) -> None:
    world = touching(plugin_world, files)
    world.step(20)
    output = world.output("/collisions")
    world.step()
    (collision,) = output.latest.collisions
    assert collision.entity_b == "obstacle"
    assert len(collision.magnitude_forces) == 1


def test_walls_of_a_layer(plugin_world: Any, files: Any) -> None:
    map_path = files.write_map("room", ["...", ".#.", "..."], origin="[0.2, -1.5, 0]")
    world = plugin_world(
        BUMPER,
        bodies=DISC,
        pose=(1.1, 0, 0),
        layers=f"[{{name: [room, floor], map: {map_path}}}]",
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


def test_force_at_impact_stops_the_body(plugin_world: Any, files: Any) -> None:
    world = touching(plugin_world, files)
    base = world.model("robot").body("base")
    base.set_velocity(0.4, 0.0, 0.0)
    output = world.output("/collisions")
    world.step()
    (collision,) = output.latest.collisions
    assert collision.magnitude_forces == pytest.approx([base.mass * 0.4 / DT], rel=1e-3)


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


def test_sensor_contacts_have_empty_lists(plugin_world: Any, files: Any) -> None:
    sensor = """
    - name: base
      footprints: [{type: circle, radius: 0.2, density: 10, sensor: true}]
    """
    world = touching(plugin_world, files, bodies=sensor)
    output = world.output("/collisions")
    world.step(2)
    (collision,) = output.latest.collisions
    assert collision.magnitude_forces.shape == (0,)
    assert collision.contact_positions.shape == (0, 2)
    assert collision.contact_normals.shape == (0, 2)


def test_each_pair_of_fixtures_has_a_record(plugin_world: Any, files: Any) -> None:
    two = """
    - name: base
      footprints:
        - {type: circle, radius: 0.2, density: 10}
        - {type: circle, radius: 0.3, density: 0, sensor: true}
    """
    world = touching(plugin_world, files, bodies=two)
    output = world.output("/collisions")
    world.step()
    lengths = sorted(len(c.magnitude_forces) for c in output.latest.collisions)
    assert lengths == [0, 1]


def test_a_record_is_removed_at_the_end_of_the_contact(plugin_world: Any, files: Any) -> None:
    world = touching(plugin_world, files)
    output = world.output("/collisions")
    world.step()
    assert len(output.latest.collisions) == 1
    world.move_model("robot", (-3, 0, 0))
    world.step()
    assert output.latest.collisions == ()


def test_a_record_is_removed_when_the_other_model_is_deleted(plugin_world: Any, files: Any) -> None:
    world = touching(plugin_world, files)
    output = world.output("/collisions")
    world.step()
    world.delete_model("obstacle")
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


def test_contacts_between_other_models_are_ignored(plugin_world: Any, files: Any) -> None:
    world = plugin_world(BUMPER, bodies=DISC, pose=(0, 5, 0))
    files.write("mover.model.yaml", "bodies:" + DISC.replace("\n", "\n  "))
    world.spawn_model("mover.model.yaml", "mover")
    put(world, files, WALL, 0.199)
    output = world.output("/collisions")
    world.step()
    assert len(world.contacts) == 1
    assert output.latest.collisions == ()


def test_an_illegal_topic_is_an_error(plugin_world: Any) -> None:
    error = plugin_world.error("[{type: Bumper, name: bumper, topic: 'a b'}]")
    assert 'Model Plugin "bumper" type "Bumper" model "robot": "a b" is not a legal topic' in error
