"""The example plugin OneWayGate: which bodies pass, and how long a decision holds."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from flatland import PluginError

DISC = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
GATE = """
bodies:
  - {name: gate, type: static, footprints: [
      {type: polygon, points: [[-0.1, -1], [0.1, -1], [0.1, 1], [-0.1, 1]], density: 0}]}
  - {name: post, type: static, pose: [0, 3, 0], footprints: [
      {type: polygon, points: [[-0.1, -1], [0.1, -1], [0.1, 1], [-0.1, 1]], density: 0}]}
plugins: [{name: g, type: "my_robots::OneWayGate"}]
"""
LONG_ROBOT = """
bodies:
  - {name: base, footprints: [
      {type: circle, radius: 0.2, center: [0.5, 0], density: 1},
      {type: polygon, points: [[-0.6, -0.1], [0.6, -0.1], [0.6, 0.1], [-0.6, 0.1]], density: 1},
      {type: circle, radius: 0.2, center: [-0.5, 0], density: 1}]}
"""


def gate_world(load, robot=DISC, yaw=0.0):
    """Loads a world with the gate at (0, 0), rotated by `yaw`, and a robot 2 m behind it."""
    world = load(gate=GATE, robot=robot)
    world.move_model("gate", (0, 0, yaw))
    put(world, "robot", -2, 0, yaw)
    return world


def put(world, name, x, y, yaw=0.0):
    """Places a model at a point in the frame of the gate, which is rotated by `yaw`."""
    c, s = math.cos(yaw), math.sin(yaw)
    world.move_model(name, (c * x - s * y, s * x + c * y, yaw))


def drive(world, speed, seconds, name="robot", yaw=0.0):
    """Moves a model along the x axis of the gate and returns its final position on that axis."""
    body = world.model(name).bodies[0]
    for _ in range(round(seconds / 0.005)):
        body.set_velocity(speed * math.cos(yaw), speed * math.sin(yaw), 0)
        world.step()
    x, y, _ = body.pose
    return x * math.cos(yaw) + y * math.sin(yaw)


@pytest.mark.parametrize("yaw", [0.0, 0.7, math.pi / 2, -2.5])
@pytest.mark.parametrize("robot", [DISC, LONG_ROBOT])
def test_gate_opens_from_behind_only(load, robot, yaw):
    world = gate_world(load, robot, yaw)
    assert drive(world, 1.0, 4.0, yaw=yaw) == pytest.approx(2.0, abs=0.01)
    reach = 0.2 if robot != LONG_ROBOT else 0.7
    assert drive(world, -1.0, 4.0, yaw=yaw) == pytest.approx(0.1 + reach, abs=0.03)


def test_gate_keeps_its_decision_during_the_contact(load):
    """A robot that is mostly on the other side may continue or return."""
    world = gate_world(load, LONG_ROBOT)
    assert drive(world, 1.0, 2.4) == pytest.approx(0.4, abs=0.01)
    assert drive(world, -1.0, 2.4) == pytest.approx(-2.0, abs=0.01)
    assert drive(world, 1.0, 2.4) == pytest.approx(0.4, abs=0.01)
    assert drive(world, 1.0, 1.0) == pytest.approx(1.4, abs=0.01)
    assert drive(world, -1.0, 2.0) > 0.7


def test_gate_decides_separately_for_each_body(load):
    world = gate_world(load)
    world.spawn_model("robot.yaml", "other")
    put(world, "other", 2, 0.5)
    robot, other = (world.model(name).bodies[0] for name in ("robot", "other"))
    for _ in range(800):
        robot.set_velocity(1, 0, 0)
        other.set_velocity(-1, 0, 0)
        world.step()
    assert robot.pose[0] == pytest.approx(2.0, abs=0.01)
    assert other.pose[0] == pytest.approx(0.3, abs=0.03)


def test_other_bodies_of_the_model_are_not_gates(load):
    world = gate_world(load)
    put(world, "robot", -2, 3)
    assert drive(world, 1.0, 4.0) == pytest.approx(-0.3, abs=0.03)


def test_gate_ignores_sensor_fixtures(load):
    """A sensor with a long range does not keep the gate open for the return."""
    sensor = ", {type: circle, radius: 4, density: 0, sensor: true}]"
    world = gate_world(load, DISC.replace("]}", sensor + "}"))
    assert drive(world, 1.0, 4.0) == pytest.approx(2.0, abs=0.01)
    assert len(world.contacts) >= 1, "the sensor must touch the gate all the time"
    assert drive(world, -1.0, 4.0) == pytest.approx(0.3, abs=0.03)


def test_gate_drops_the_records_of_deleted_models(load):
    world = gate_world(load, LONG_ROBOT)
    plugin = world.model("gate").plugin("g")
    drive(world, 1.0, 2.4)
    assert list(plugin._may_pass) == [world.model("robot").bodies[0]]
    world.delete_model("robot")
    world.step()
    assert plugin._may_pass == plugin._contacts == {}


def test_gate_keeps_its_decision_when_one_contact_replaces_another(load):
    world = gate_world(load, LONG_ROBOT)
    plugin = world.model("gate").plugin("g")
    drive(world, 1.0, 2.4)
    [(robot, ids)] = plugin._contacts.items()
    fake = SimpleNamespace(
        body_a=plugin._body, body_b=robot, fixture_a=None, fixture_b=None, is_sensor=False
    )
    for contact_id in list(ids):
        plugin.end_contact(SimpleNamespace(**vars(fake), contact_id=contact_id))
    plugin.begin_contact(SimpleNamespace(**vars(fake), contact_id=12345))
    plugin.after_physics_step(world.timekeeper)
    assert plugin._may_pass == {robot: True}
    assert plugin._contacts == {robot: {12345}}


def test_gate_rejects_an_unknown_body(load):
    with pytest.raises(PluginError, match='Body with name "door" does not exist') as caught:
        load(gate=GATE.replace('::OneWayGate"', '::OneWayGate", body: door'))
    assert 'Model Plugin "g" type "my_robots::OneWayGate" model "gate"' in str(caught.value)
