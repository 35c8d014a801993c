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
NEAR_BODIES = TWO_BODIES.replace("-0.5", "-0.39")  # which touch each other
SENSOR_DISC = """
- name: base
  footprints:
    - {type: circle, radius: 0.2, density: 1, sensor: true}
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


@pytest.mark.parametrize(
    "end",
    [lambda world: world.move_model("robot", (-3, 0, 0)), lambda world: world.delete_model("wall")],
    ids=["moved", "other model deleted"],
)
def test_false_after_the_end_of_the_contact(
    plugin_world: Any, files: Any, collect: Collect, end: Callable[[flatland.World], None]
) -> None:
    world = plugin_world(SENSOR)
    put_wall(world, files)
    messages = collect(world, "/bool_sensor")
    world.step()
    end(world)
    world.step(2)
    assert messages == [True, False, False]


@pytest.mark.parametrize(
    ("bodies", "body", "wall", "expected"),
    [
        # The reference counts the contacts of every body of the model.
        (TWO_BODIES, "body: base", 0.199, True),
        (TWO_BODIES, "body: arm", 0.199, False),
        # The default is the first body.
        (TWO_BODIES, "", 0.199, True),
        (TWO_BODIES, "", -0.899, False),
        (NEAR_BODIES, "body: base", None, True),
        (NEAR_BODIES, "body: arm", None, True),
        (SENSOR_DISC, "", 0.199, True),
        # Fixtures of one body do not touch each other.
        (SENSOR_DISC + "    - {type: circle, radius: 0.3, density: 1}\n", "", None, False),
    ],
)
def test_contacts_of_the_body_are_detected(
    plugin_world: Any, files: Any, bodies: str, body: str, wall: float | None, expected: bool
) -> None:
    world = plugin_world(f"[{{type: BoolSensor, name: switch, {body}}}]", bodies=bodies)
    if wall is not None:
        put_wall(world, files, wall)
    output = world.output("/bool_sensor")
    world.step()
    assert output.latest is expected
    assert len(world.contacts) == (expected or wall is not None)


def test_several_contacts_end_one_by_one(plugin_world: Any, files: Any) -> None:
    world = plugin_world(SENSOR, bodies=NEAR_BODIES)
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
