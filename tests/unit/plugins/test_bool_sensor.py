"""BoolSensor: detected contacts, and the times of its messages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import flatland

WALL = """
bodies:
  - name: slab
    type: static
    footprints:
      - {type: polygon, density: 1, points: [[0, -1], [0.2, -1], [0.2, 1], [0, 1]]}
"""
# The arm is far from the base, and does not touch the wall at x = 0.199.
TWO_BODIES = """
- name: base
  footprints: [{type: circle, radius: 0.2, density: 1}]
- name: arm
  pose: [-0.5, 0, 0]
  footprints: [{type: circle, radius: 0.2, density: 1}]
"""
SENSOR = "[{type: BoolSensor, name: switch}]"

Collect = Callable[[flatland.World, str], list[Any]]


def put_wall(world: flatland.World, files: Any, x: float = 0.199) -> None:
    world.spawn_model(files.write("wall.model.yaml", WALL), "wall", pose=(x, 0, 0))


def test_defaults(plugin_world: Any, files: Any, collect: Collect) -> None:
    # The reference doubles the namespace in the topic.
    world = plugin_world(SENSOR, namespace="r1")
    assert list(world.ports.outputs) == ["/r1/bool_sensor"]
    messages = collect(world, "/r1/bool_sensor")
    world.step(2)
    put_wall(world, files)
    world.step(2)
    assert messages == [False, False, True, True]
    assert all(type(message) is bool for message in messages)


def test_false_after_the_end_of_the_contact(
    plugin_world: Any, files: Any, collect: Collect
) -> None:
    world = plugin_world(SENSOR)
    put_wall(world, files)
    messages = collect(world, "/bool_sensor")
    world.step()
    world.move_model("robot", (-3, 0, 0))
    world.step(2)
    assert messages == [True, False, False]


def test_false_after_the_other_model_is_deleted(plugin_world: Any, files: Any) -> None:
    world = plugin_world(SENSOR)
    put_wall(world, files)
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is True
    world.delete_model("wall")
    world.step()
    assert output.latest is False


@pytest.mark.parametrize(("body", "expected"), [("base", True), ("arm", False)])
def test_contacts_of_other_bodies_are_ignored(
    plugin_world: Any, files: Any, body: str, expected: bool
) -> None:
    # The reference counts the contacts of every body of the model.
    world = plugin_world(f"[{{type: BoolSensor, name: switch, body: {body}}}]", bodies=TWO_BODIES)
    put_wall(world, files)
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is expected


def test_the_default_body_is_the_first_one(plugin_world: Any, files: Any) -> None:
    world = plugin_world(SENSOR, bodies=TWO_BODIES)
    output = world.output("/bool_sensor")
    put_wall(world, files)
    world.step()
    assert output.latest is True
    world.move_model("wall", (-0.899, 0, 0))
    world.step()
    assert output.latest is False
    assert len(world.contacts) == 1


@pytest.mark.parametrize("body", ["base", "arm"])
def test_contacts_with_other_bodies_of_the_model_are_detected(plugin_world: Any, body: str) -> None:
    world = plugin_world(
        f"[{{type: BoolSensor, name: switch, body: {body}}}]",
        bodies=TWO_BODIES.replace("-0.5", "-0.39"),
    )
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is True


def test_fixtures_of_one_body_do_not_touch_each_other(plugin_world: Any) -> None:
    two = """
    - name: base
      footprints:
        - {type: circle, radius: 0.2, density: 1}
        - {type: circle, radius: 0.3, density: 1, sensor: true}
    """
    world = plugin_world(SENSOR, bodies=two)
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is False


def test_contacts_with_sensor_fixtures_are_detected(plugin_world: Any, files: Any) -> None:
    sensor = """
    - name: base
      footprints: [{type: circle, radius: 0.2, density: 1, sensor: true}]
    """
    world = plugin_world(SENSOR, bodies=sensor)
    put_wall(world, files)
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is True


def test_contacts_with_walls_are_detected(plugin_world: Any, files: Any) -> None:
    map_path = files.write_map("room", ["...", ".#.", "..."])
    world = plugin_world(SENSOR, pose=(0.9, 1.5, 0), layers=f"[{{name: 2d, map: {map_path}}}]")
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is True


def test_several_contacts_end_one_by_one(plugin_world: Any, files: Any) -> None:
    world = plugin_world(SENSOR, bodies=TWO_BODIES.replace("-0.5", "-0.39"))
    put_wall(world, files)
    output = world.output("/bool_sensor")
    world.step()
    assert len(world.contacts) == 2
    world.delete_model("wall")
    world.step()
    assert output.latest is True


def test_a_contact_between_two_messages_is_reported_once(
    plugin_world: Any, files: Any, collect: Collect
) -> None:
    world = plugin_world("[{type: BoolSensor, name: switch, update_rate: 20}]")
    messages = collect(world, "/bool_sensor")
    world.step(10)
    assert messages == [False]
    put_wall(world, files)
    world.step(2)
    world.move_model("robot", (-3, 0, 0))
    world.step(28)
    assert messages == [False, True, False, False]


def test_a_late_subscriber_receives_an_existing_contact(plugin_world: Any, files: Any) -> None:
    world = plugin_world(SENSOR)
    put_wall(world, files)
    world.step(10)
    assert world.ports.find_output("/bool_sensor").latest is None
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is True


def test_a_late_subscriber_does_not_receive_a_past_contact(plugin_world: Any, files: Any) -> None:
    world = plugin_world(SENSOR)
    put_wall(world, files)
    world.step()
    world.move_model("robot", (-3, 0, 0))
    world.step(10)
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is False
