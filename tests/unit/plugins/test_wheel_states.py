"""WheelStates: angles in closed form, encoders, moves and errors."""

from __future__ import annotations

import math
from typing import Any

import pytest

import flatland

WHEELS = (
    "wheels: [{name: left, position: [0, 0.2], radius: 0.1}, "
    "{name: right, position: [0, -0.2], radius: 0.1}]"
)


def plugins(text: str = "", wheels: str = WHEELS, drive: str = "DiffDrive") -> str:
    return (
        f"[{{type: {drive}, name: drive, body: base}}, "
        f"{{type: WheelStates, name: wheels, body: base, {wheels}, {text}}}]"
    )


def command(world: flatland.World, x: float, omega: float, y: float = 0.0) -> None:
    world.command("/cmd_vel").set(flatland.Twist(x, y, omega))


def wheels(world: flatland.World) -> Any:
    return world.model("robot").plugin("wheels")


def test_straight_and_turning(plugin_world: Any) -> None:
    world = plugin_world(plugins(), pose=(3.0, -2.0, 0.4))
    command(world, 0.5, 0.0)
    world.step(400)
    assert wheels(world).angles == pytest.approx((10.0, 10.0), abs=1e-3)
    assert wheels(world).speeds == pytest.approx((5.0, 5.0), abs=1e-4)
    command(world, 0.0, 1.5)
    world.step(400)
    assert wheels(world).angles == pytest.approx((10.0 - 6.0, 10.0 + 6.0), abs=1e-3)
    assert wheels(world).speeds == pytest.approx((-3.0, 3.0), abs=1e-4)


def test_arcs_are_exact_for_large_steps(plugin_world: Any) -> None:
    """The chord of a step is converted to the arc: 1 rad in ten steps, radius 1 m."""
    world = plugin_world(plugins(), step_size=0.1)
    command(world, 1.0, 1.0)
    world.step(10)
    left, right = wheels(world).angles
    # The turn about the origin of the body is exact; its way is the chord of a semi-implicit step.
    assert right - left == pytest.approx(1.0 * 0.4 / 0.1, abs=1e-5)
    assert (left + right) / 2 == pytest.approx(10.0, rel=2e-3)


def test_a_blocked_robot_does_not_turn_its_wheels(plugin_world: Any) -> None:
    world = plugin_world(plugins())
    wall = """
bodies:
  - name: slab
    type: static
    footprints: [{type: polygon, density: 1, points: [[0, -1], [0.2, -1], [0.2, 1], [0, 1]]}]
"""
    world.spawn_model("\n" + wall, "wall", pose=(0.7, 0.0, 0.0))
    command(world, 0.5, 0.0)
    world.step(1000)
    assert wheels(world).angles == pytest.approx((5.0, 5.0), abs=0.1)


def test_mecanum_wheels_roll_as_the_inverse_kinematics(plugin_world: Any) -> None:
    slant = "roller_angle: 0.7853981633974483"
    given = (
        f"wheels: [{{name: fl, position: [0.25, 0.15], radius: 0.1, {slant}}}, "
        "{name: fr, position: [0.25, -0.15], radius: 0.1, roller_angle: -0.7853981633974483}]"
    )
    world = plugin_world(plugins(wheels=given, drive="OmniDrive"))
    command(world, 0.0, 0.0, y=0.3)
    world.step(200)
    assert wheels(world).angles == pytest.approx((-3.0, 3.0), abs=1e-3)
    command(world, 0.0, 0.5)
    world.step(200)
    assert wheels(world).angles == pytest.approx((-3.0 - 2.0, 3.0 + 2.0), abs=1e-3)


def test_wheel_of_another_body(plugin_world: Any) -> None:
    bodies = """
- name: base
  footprints: [{type: circle, radius: 0.2, density: 1}]
- name: caster
  pose: [-0.3, 0, 1.5707963267948966]
  footprints: [{type: circle, radius: 0.05, density: 1}]
"""
    joints = (
        "[{name: j, type: weld, bodies: [{name: base, anchor: [-0.3, 0]}, "
        "{name: caster, anchor: [0, 0]}], angle: 1.5707963267948966}]"
    )
    given = "wheels: [{name: c, body: caster, radius: 0.05}]"
    world = plugin_world(plugins(wheels=given), bodies=bodies, joints=joints)
    command(world, 0.0, 1.0)
    world.step(200)
    # The caster moves to the right of the robot, backwards along its own heading.
    assert wheels(world).angles[0] == pytest.approx(-0.3 / 0.05, rel=0.01)


def test_encoder_rounds_to_ticks(plugin_world: Any) -> None:
    world = plugin_world(plugins("ticks_per_turn: 100, update_rate: 50"))
    state = world.output("/joint_states")
    command(world, -0.37, 0.0)
    world.step(333)
    tick = math.tau / 100
    for position in state.latest.positions:
        ticks = position / tick
        assert ticks == pytest.approx(round(ticks), abs=1e-9)
        assert 0 <= -0.37 * (state.latest.stamp / 1e9) / 0.1 - position <= tick + 1e-4
    assert state.latest.names == ("left", "right")
    assert state.latest.velocities == pytest.approx((-3.7, -3.7), abs=1e-4)


def test_a_move_does_not_turn_the_wheels(plugin_world: Any) -> None:
    world = plugin_world(plugins())
    command(world, 0.5, 0.0)
    world.step(100)
    world.move_model("robot", (50.0, 3.0, 1.0))
    assert wheels(world).angles == pytest.approx((2.5, 2.5), abs=1e-3)
    world.step(100)
    assert wheels(world).angles == pytest.approx((5.0, 5.0), abs=2e-3)
