"""The example plugin OneWayGate: directions, and the duration of its decisions."""

from __future__ import annotations

import math

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
    """Returns a world with the gate at (0, 0, yaw) and a robot 2 m away on its -x side."""
    world = load(gate=GATE, robot=robot)
    world.move_model("gate", (0, 0, yaw))
    put(world, "robot", -2, 0, yaw)
    return world


def put(world, name, x, y, yaw=0.0):
    """Moves a model to a point in the frame of the gate, which is rotated by `yaw`."""
    c, s = math.cos(yaw), math.sin(yaw)
    world.move_model(name, (c * x - s * y, s * x + c * y, yaw))


def drive(world, speed, seconds, name="robot", yaw=0.0):
    """Drives a model along the x axis of the gate; returns its final x in that frame [m]."""
    body = world.model(name).bodies[0]
    for _ in range(round(seconds / 0.005)):
        body.set_velocity(speed * math.cos(yaw), speed * math.sin(yaw), 0)
        world.step()
    x, y, _ = body.pose
    return x * math.cos(yaw) + y * math.sin(yaw)


@pytest.mark.parametrize("yaw", [0.0, -2.5])
@pytest.mark.parametrize("robot", [DISC, LONG_ROBOT])
def test_gate_can_be_passed_in_one_direction_only(load, robot, yaw):
    world = gate_world(load, robot, yaw)
    assert drive(world, 1.0, 4.0, yaw=yaw) == pytest.approx(2.0, abs=0.01)
    reach = 0.2 if robot != LONG_ROBOT else 0.7
    assert drive(world, -1.0, 4.0, yaw=yaw) == pytest.approx(0.1 + reach, abs=0.03)


def test_gate_keeps_its_decision_while_the_robot_touches_it(load):
    """A robot that has passed half-way can reverse and continue."""
    world = gate_world(load, LONG_ROBOT)
    assert drive(world, 1.0, 2.4) == pytest.approx(0.4, abs=0.01)
    assert drive(world, -1.0, 2.4) == pytest.approx(-2.0, abs=0.01)
    assert drive(world, 1.0, 2.4) == pytest.approx(0.4, abs=0.01)
    assert drive(world, 1.0, 1.0) == pytest.approx(1.4, abs=0.01)
    assert drive(world, -1.0, 2.0) > 0.7


def test_gate_decides_for_each_body_separately(load):
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


def test_gate_consists_of_one_body_of_its_model(load):
    world = gate_world(load)
    put(world, "robot", -2, 3)
    assert drive(world, 1.0, 4.0) == pytest.approx(-0.3, abs=0.03)


def test_gate_ignores_contacts_of_sensors(load):
    """A large sensor that still touches the gate does not keep it open for the way back."""
    sensor = ", {type: circle, radius: 4, density: 0, sensor: true}]"
    world = gate_world(load, DISC.replace("]}", sensor + "}"))
    assert drive(world, 1.0, 4.0) == pytest.approx(2.0, abs=0.01)
    assert len(world.contacts) >= 1, "the sensor does not touch the gate"
    assert drive(world, -1.0, 4.0) == pytest.approx(0.3, abs=0.03)


def test_gate_rejects_a_body_that_does_not_exist(load):
    with pytest.raises(PluginError, match='Body with name "door" does not exist') as caught:
        load(gate=GATE.replace('::OneWayGate"', '::OneWayGate", body: door'))
    assert 'Model Plugin "g" type "my_robots::OneWayGate" model "gate"' in str(caught.value)
